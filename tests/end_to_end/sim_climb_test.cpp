// SPDX-License-Identifier: Apache-2.0
// Whole climbs, end to end: what the issue asks of every seed, of causality, and of repetition.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <ostream>
#include <string>

#include "sim_stub/host/climb/climb.hpp"
#include "sim_stub/host/estimate/estimate_replay.hpp"
#include "sim_stub/host/estimate/estimate_score.hpp"
#include "sim_stub/host/perceive/perceive.hpp"

namespace polygmap::sim {
namespace {

ClimbSummary climb(const ClimbOptions& options) { return run_climb(options, {}); }

ClimbOptions options_of(std::uint64_t seed, int steps) {
  ClimbOptions options;
  options.plant = PlantKind::kKinematic;  // the quick one; sim_climb_physics_test has the other
  options.seed = seed;
  options.stairs.steps = steps;
  options.noise = seed % 2 == 0 ? NoiseKind::kCorrelated : NoiseKind::kWhite;
  return options;
}

int steps_onto_treads(const ClimbSummary& summary) {
  int count = 0;
  for (const Footstep& step : summary.footsteps) count += step.onto_tread ? 1 : 0;
  return count;
}

// Of 30 Hz: in a few frames a surface is missed or one is none, in more of them below a nosing, which hides its riser.
double least_plane_rate_hz(const StairParams& stairs) { return stairs.nosing_m > 0.0 ? 28.0 : 29.0; }

// Every figure that a passing climb must show.
void expect_a_good_climb(const ClimbSummary& summary, const StairParams& stairs) {
  EXPECT_TRUE(summary.pass) << summary.reason;
  EXPECT_FALSE(summary.fell);
  EXPECT_EQ(summary.steps_climbed, stairs.steps);
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_GE(summary.stand_off_m, 0.020);
  EXPECT_LE(summary.execution_error_m.max, 0.0124);
  EXPECT_LE(summary.foothold_error_m.max, 0.0124);
  EXPECT_GE(summary.sole_margin_min_m, 0.0);
  EXPECT_GT(summary.swing_clearance_min_m, 0.0);
  EXPECT_GE(summary.seconds_per_step, 2.35);  // a plan that leaves something out would be quicker
  EXPECT_LE(summary.seconds_per_step, 3.75);  // the slowest of the paper's trials
  EXPECT_GE(summary.plane_rate_hz, least_plane_rate_hz(stairs));
  EXPECT_LE(summary.exposure_to_map_ms.max, 64.0);
  EXPECT_LE(summary.map_age_at_latch_ms.max, 100.0);
  EXPECT_EQ(summary.heap_calls, 0U);
}

struct Case {
  std::uint64_t seed;
  StairParams stairs;
};
std::string name_of(const testing::TestParamInfo<Case>& info) {
  const StairParams &stairs = info.param.stairs, usual;
  std::string name = "seed" + std::to_string(info.param.seed) + "_steps" + std::to_string(stairs.steps);
  const auto add_mm = [&name](const char* what, double length_m) {
    name += what + std::to_string(std::lround(length_m * 1000));
  };
  add_mm("_rise", stairs.rise_m);
  if (stairs.tread_m != usual.tread_m) add_mm("_tread", stairs.tread_m);
  if (stairs.width_m != usual.width_m) add_mm("_width", stairs.width_m);
  if (stairs.nosing_m != usual.nosing_m) add_mm("_nosing", stairs.nosing_m);
  return name;
}
// The name says it all; the default prints bytes, padding included.
void PrintTo(const Case& c, std::ostream* out) { *out << "seed " << c.seed; }
class Climb : public testing::TestWithParam<Case> {};

TEST_P(Climb, StairsSeenOnlyInDepth_ClimbedWithinTheFigures) {
  ClimbOptions options = options_of(GetParam().seed, GetParam().stairs.steps);
  options.stairs = GetParam().stairs;
  expect_a_good_climb(climb(options), options.stairs);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Climb,
                         testing::Values(Case{1, {.rise_m = 0.13}}, Case{2, {.rise_m = 0.17}},
                                         Case{3, {.rise_m = 0.10}}, Case{4, {.rise_m = 0.15}},
                                         Case{1, {.steps = 4, .rise_m = 0.17, .nosing_m = 0.025}},
                                         Case{6, {.steps = 4, .nosing_m = 0.040}},
                                         Case{2, {.steps = 4, .rise_m = 0.10, .width_m = 0.8}},
                                         Case{3, {.steps = 4, .rise_m = 0.15, .tread_m = 0.30, .width_m = 1.6}},
                                         Case{4, {.steps = 4, .rise_m = 0.13, .tread_m = 0.35}}),
                         name_of);

// Once every climb stopped here with "a tread of 0.121 m": a post ended the tread as an endless line would.
TEST(ClimbBalusters, PostsOnTheTreadsAlongBothEdges_Climbed) {
  ClimbOptions options = options_of(3, 3);
  options.stairs.balusters.spacing_m = 0.28;
  const ClimbSummary summary = climb(options);
  EXPECT_TRUE(summary.pass) << summary.reason;
  EXPECT_EQ(summary.steps_climbed, 3);
}

// The one climb that every build runs, sanitizers included.
TEST(ClimbOneStep, ThreadedRendering_Climbed) {
  const ClimbSummary summary = climb(options_of(6, 1));
  EXPECT_TRUE(summary.pass) << summary.reason;
  EXPECT_EQ(summary.steps_climbed, 1);
  EXPECT_EQ(summary.heap_calls, 0U);
}

TEST(ClimbOneStep, SavedInputs_AreRead_AndTheEstimatorFollowsItsTruth) {
  const std::string folder = testing::TempDir() + "polygmap_saved_inputs";
  std::filesystem::create_directories(folder + "/inputs");
  ClimbOptions options = options_of(6, 1);
  options.out_dir = folder;
  options.save_inputs = true;
  EXPECT_EQ(climb(options).heap_calls, 0U);
  const EstimateLog log = read_estimate_log(folder + "/inputs/log.csv");
  const std::vector<LioRow> lio = read_lio_log(folder + "/inputs/lio.csv", log.start_s);
  ASSERT_TRUE(log.has_truth);
  const Score scored = score(log, replay(log, lio, {}));
  EXPECT_GT(scored.distance_m, 1.0);
  EXPECT_LT(scored.position_rmse_m, 0.02);
  const DepthPng picture = read_depth(folder + "/inputs/depth_02.png");
  EXPECT_EQ(picture.width_px, 640);
  EXPECT_EQ(picture.height_px, 480);
}

TEST(ClimbContacts, SensedToo_ClimbedWithinTheFigures) {
  for (const std::uint64_t seed : {1U, 2U}) {
    ClimbOptions options = options_of(seed, 4);
    options.foot_sensors = true;
    expect_a_good_climb(climb(options), options.stairs);
  }
}

TEST(ClimbContacts, SensorsThatAreNoisyOrOff_ClimbedUnderPhysics) {
  for (const std::uint64_t seed : {1U, 2U}) {
    ClimbOptions options = options_of(seed, 4);
    options.plant = PlantKind::kMujoco;
    options.foot_sensors = true;
    options.reality.sensors.foot_force_noise_n = seed == 1 ? 20.0 : 0.0;
    options.reality.sensors.foot_force_offset_n = {seed == 1 ? 0.0 : 60.0, seed == 1 ? 0.0 : -60.0};
    const ClimbSummary summary = climb(options);
    EXPECT_TRUE(summary.pass) << "seed " << seed << ": " << summary.reason;
  }
}

std::vector<Case> long_cases() {
  constexpr double kRises_m[]{0.13, 0.10, 0.17, 0.15, 0.12};
  std::vector<Case> cases;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) cases.push_back({seed, {.rise_m = kRises_m[seed % 5]}});
  for (const double nosing_m : {0.020, 0.025, 0.030, 0.040}) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) cases.push_back({seed, {.steps = 4, .nosing_m = nosing_m}});
  }
  return cases;
}
INSTANTIATE_TEST_SUITE_P(Long, Climb, testing::ValuesIn(long_cases()), name_of);

TEST(ClimbRepetition, SameSeedThreadedOrNot_SameSummaryByteForByte) {
  ClimbOptions options = options_of(2, 2);
  const auto text = [&options] {
    const std::string all = summary_text(climb(options));
    return all.substr(0, all.find("\"wall\""));  // the last key
  };
  const std::string first = text();
  options.threaded_render = false;
  EXPECT_EQ(first, text());
  EXPECT_GT(first.size(), 1000U);
}

void expect_to_name(const std::string& what, double true_m, const std::string& reason) {
  const std::size_t at = reason.find(what);
  ASSERT_NE(at, std::string::npos) << reason;
  EXPECT_NEAR(std::stod(reason.substr(at + what.size())), true_m, 0.015) << reason;
}

// The robot starts from the same place and sees a staircase that stands elsewhere than the one it walks on. The stairs'
// x axis is the true world's.
void expect_footholds_to_move_by(double dx_m, double dy_m, double dz_m) {
  ClimbOptions options = options_of(5, 1);
  // 30 mm too near, the robot has no millimetre to spare before the first step.
  options.reality.sensors.camera_mount_rad = options.reality.sensors.camera_mount_m = 0.0;
  const ClimbSummary straight = climb(options);
  options.render_dx_m = dx_m;
  options.render_dy_m = dy_m;
  options.render_dz_m = dz_m;
  const ClimbSummary shifted = climb(options);
  ASSERT_GE(steps_onto_treads(straight), 1);
  int compared = 0;
  for (const Footstep& a : straight.footsteps) {
    for (const Footstep& b : shifted.footsteps) {
      if (!a.onto_tread || !b.onto_tread || a.foot != b.foot) continue;
      const Vec3 moved_m = b.true_T_planned.p_m - a.true_T_planned.p_m;
      EXPECT_NEAR(moved_m.x(), dx_m, 0.005);
      EXPECT_NEAR(moved_m.y(), dy_m, 0.005);
      EXPECT_NEAR(moved_m.z(), dz_m, 0.005);
      ++compared;
    }
  }
  EXPECT_GE(compared, 1);
}
TEST(ClimbCausality, PictureShifted30mmAhead_FootholdsFollow) { expect_footholds_to_move_by(0.03, 0, 0); }
TEST(ClimbCausality, PictureShifted30mmAside_FootholdsFollow) { expect_footholds_to_move_by(0, 0.03, 0); }
TEST(ClimbCausality, PictureRaised20mm_FootholdsFollow) { expect_footholds_to_move_by(0, 0, 0.02); }

TEST(ClimbCausality, BlankDepth_NoStepOntoAnythingAndTheReasonIsNamed) {
  ClimbOptions options = options_of(1, 2);
  options.blank_depth = true;
  const ClimbSummary summary = climb(options);
  EXPECT_FALSE(summary.pass);
  EXPECT_FALSE(summary.fell);
  EXPECT_EQ(steps_onto_treads(summary), 0);
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_NE(summary.reason.find("measured no depth"), std::string::npos) << summary.reason;
}

TEST(ClimbCausality, SunOnTheLowerTreads_NoStepOntoAnythingAndTheReasonIsThePicture) {
  ClimbOptions options = options_of(1, 3);
  options.reality.camera.sun_patch_m = 1.0;
  const ClimbSummary summary = climb(options);
  EXPECT_EQ(steps_onto_treads(summary), 0);
  EXPECT_NE(summary.reason.find("measured no depth"), std::string::npos) << summary.reason;
}

TEST(ClimbCausality, NoiseBeyondTheCameras_NoStepOntoAnythingAndTheReasonIsTheNoise) {
  ClimbOptions options = options_of(4, 3);
  options.reality.sensors.depth_noise = 10.0;
  const ClimbSummary summary = climb(options);
  EXPECT_EQ(steps_onto_treads(summary), 0);
  EXPECT_NE(summary.reason.find("too noisy"), std::string::npos) << summary.reason;
}

TEST(ClimbCausality, StepMissingFromThePicture_ClimbsUpToItAndNamesTheRiseBeyond) {
  ClimbOptions options = options_of(1, 4);
  options.render_missing_step = 2;
  const ClimbSummary summary = climb(options);
  EXPECT_FALSE(summary.pass);
  EXPECT_FALSE(summary.fell) << summary.reason;
  EXPECT_EQ(summary.steps_climbed, 2);
  EXPECT_EQ(summary.ended_by, "module");
  for (const Footstep& step : summary.footsteps) EXPECT_LE(step.step_index, 1);
  const double two_rises_m = 2 * options.stairs.rise_m;
  expect_to_name("too high to step on (", two_rises_m, summary.reason);
}

// The picture of the stairs hangs above the stairs: the foot finds nothing to stand on.
TEST(ClimbCausality, TreadsLowerThanSeen_FootIsPutBackAndTheReasonIsNamed) {
  ClimbOptions options = options_of(1, 2);
  options.stairs.rise_m = 0.10;
  options.render_dz_m = 0.06;
  const ClimbSummary summary = climb(options);
  EXPECT_FALSE(summary.fell) << summary.reason;
  EXPECT_EQ(summary.steps_climbed, 0);
  EXPECT_GT(summary.swing_clearance_min_m, 0.0);
  EXPECT_NE(summary.reason.find("no ground"), std::string::npos) << summary.reason;
}

TEST(ClimbCausality, SelfFilterOff_LegsAreTakenForSurfaces) {
  ClimbOptions options = options_of(1, 2);
  const ClimbSummary filtered = climb(options);
  options.self_filter = false;
  const ClimbSummary unfiltered = climb(options);
  EXPECT_GT(unfiltered.surfaces_unmatched, filtered.surfaces_unmatched + 10);
}

TEST(ClimbArming, ImuMountIsNotAsConfigured_EndsAtOnceAndNamesIt) {
  ClimbOptions options = options_of(1, 1);
  options.params.robot.mounts.base_R_imu = rotation_y(13.0 * kPi / 180.0);
  const ClimbSummary summary = climb(options);
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_LT(summary.ended_at_s, 4.0);
  EXPECT_TRUE(summary.reason.starts_with("The module did not arm: 13 deg between gravity")) << summary.reason;
  ASSERT_EQ(summary.states.size(), 1U);
  EXPECT_EQ(summary.states[0].state, ModuleState::kArming);
  EXPECT_TRUE(summary.footsteps.empty());
}

TEST(ClimbLimits, RiseOfHalfAMetre_ModuleStopsAndNamesTheRise) {
  ClimbOptions options = options_of(1, 3);
  options.stairs.rise_m = 0.5;
  const ClimbSummary summary = climb(options);
  EXPECT_FALSE(summary.pass);
  EXPECT_FALSE(summary.fell) << summary.reason;
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_GE(summary.stand_off_m, 0.020);
  expect_to_name("too high to step on (", 0.5, summary.reason);
}

// Shorter than the way ahead that is looked at: its end is seen, so the module knows that it is on top.
TEST(ClimbLimits, LandingOf40Centimetres_ModuleEndsByItself) {
  ClimbOptions options = options_of(1, 1);
  options.stairs.landing_m = 0.4;
  const ClimbSummary summary = climb(options);
  EXPECT_TRUE(summary.pass) << summary.reason;
  EXPECT_EQ(summary.reason.find("before the module"), std::string::npos) << summary.reason;
}

TEST(ClimbLimits, TreadOfTenCentimetres_ModuleStopsAndNamesTheTread) {
  ClimbOptions options = options_of(1, 3);
  options.stairs.tread_m = 0.1;
  const ClimbSummary summary = climb(options);
  EXPECT_FALSE(summary.pass);
  EXPECT_FALSE(summary.fell) << summary.reason;
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_GE(summary.stand_off_m, 0.020);
  expect_to_name("a tread too short for the foot (", 0.1, summary.reason);
}

}  // namespace
}  // namespace polygmap::sim
