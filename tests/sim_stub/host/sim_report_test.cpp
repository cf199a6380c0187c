// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "sim_stub/host/climb/climb_report.hpp"
#include "sim_stub/host/climb/surface_match.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/scripted_climb.hpp"

namespace polygmap::sim {
namespace {

constexpr double kUm = 1e-6;  // metres: rounding of the scripted poses

// A level or upright rectangle in the true world, handed over in the frame of a camera there.
SurfacePatch patch_of(const Transform& true_T_camera, const Vec3& true_centre_m, const Vec3& true_normal,
                      const Vec3& true_u_m, const Vec3& true_v_m) {
  const Transform camera_T_true = true_T_camera.inverse();
  SurfacePatch patch;
  patch.normal = camera_T_true.R * true_normal;
  patch.centroid_m = camera_T_true * true_centre_m;
  for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    EXPECT_TRUE(patch.polygon.try_push_back(camera_T_true * Vec3(true_centre_m + u * true_u_m + v * true_v_m)));
  }
  return patch;
}

SurfacePatch tread_patch(const Transform& true_T_camera, const StairWorld& world, std::size_t k,
                         double raised_m = 0.0) {
  const Step& s = world.steps[k];
  return patch_of(true_T_camera, Vec3(0.5 * (s.nosing_x_m + s.back_x_m), 0, s.height_m + raised_m), Vec3::UnitZ(),
                  Vec3(0.13, 0, 0), Vec3(0, 0.3, 0));
}

TEST(Spread, EvenCount_MedianIsTheMeanOfTheMiddleTwo) {
  const Spread s = spread_of({4.0, 1.0, 2.0, 10.0});
  EXPECT_DOUBLE_EQ(s.median, 3.0);
  EXPECT_DOUBLE_EQ(s.max, 10.0);
  EXPECT_DOUBLE_EQ(spread_of({7.0, 1.0, 3.0}).median, 3.0);
  EXPECT_TRUE(std::isnan(spread_of({}).max));
}

TEST(ClimbReport, FlawlessClimb_Passes) {
  ScriptedClimb climb(plain_stairs(3));
  climb.climb_all();
  const ClimbSummary s = climb.finish();
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_FALSE(s.fell);
  EXPECT_EQ(s.options.plant, PlantKind::kMujoco);
  EXPECT_EQ(s.steps_total, 3);
  EXPECT_EQ(s.steps_climbed, 3);
  EXPECT_NEAR(s.execution_error_m.max, 0.0, kUm);
  EXPECT_NEAR(s.foothold_error_m.max, 0.0, kUm);
  EXPECT_NEAR(s.odometry.rmse_fused_m, 0.0, kUm);
  EXPECT_NEAR(s.tracking_error_x_max_m, 0.0, kUm);
  ASSERT_EQ(s.footsteps.size(), 6U);
  EXPECT_EQ(s.footsteps[5].step_index, 2);
  EXPECT_LT((s.footsteps[5].true_T_planned.p_m - s.footsteps[5].true_T_landed.p_m).norm(), kUm);
}

TEST(ClimbReport, ClimbTime_CountsFromFirstLiftOffOntoTheStairsToBothFeetOnTop) {
  ScriptedClimb climb(plain_stairs(2));
  climb.wait(200 * kNsPerMs);
  // A step on the floor first: it is no part of the climb.
  Transform on_floor = climb.truth.true_T_sole[0];
  on_floor.p_m.x() += 0.05;
  climb.swing(Foot::kLeft, on_floor, -1);
  climb.climb_all();
  const ClimbSummary s = climb.finish();
  ASSERT_TRUE(s.pass) << s.reason;
  // Four swings of 400 ms from the first tick in the air (2 ms after lift-off's tick), three waits of 100 ms between.
  EXPECT_NEAR(s.climb_time_s, 4 * 0.400 + 3 * 0.100 - 0.002, 1e-9);
  EXPECT_NEAR(s.seconds_per_step, s.climb_time_s / 2, 1e-12);
  EXPECT_EQ(s.footsteps.size(), 5U);
}

TEST(ClimbReport, SoleMargin_IsOfTheWorstCornerAndNegativeMarginFails) {
  ScriptedClimb good(plain_stairs(2));
  good.climb_all({}, 0.08);
  EXPECT_NEAR(good.finish().sole_margin_min_m, 0.08 - 0.073164, kUm);
  EXPECT_NEAR(good.finish().footsteps.front().sole_margin_m, 0.08 - 0.073164, kUm);
  EXPECT_TRUE(good.finish().pass);

  ScriptedClimb bad(plain_stairs(2));
  bad.climb_all({}, 0.07);
  const ClimbSummary s = bad.finish();
  EXPECT_NEAR(s.sole_margin_min_m, 0.07 - 0.073164, kUm);
  EXPECT_FALSE(s.pass);
  EXPECT_EQ(s.steps_climbed, 0) << "a sole over the edge does not rest inside it";
}

TEST(ClimbReport, OneFootOnEveryStep_CountsTheStepsThatBothFeetHaveReached) {
  ScriptedClimb climb(plain_stairs(3));
  climb.wait(200 * kNsPerMs);
  climb.apex_m = 0.2;
  const auto onto = [&](int step, Foot foot) {
    climb.swing(foot, climb.on_step(step, foot), step);
    climb.wait(100 * kNsPerMs);
    return climb.finish().steps_climbed;
  };
  EXPECT_EQ(onto(0, Foot::kLeft), 0);
  EXPECT_EQ(onto(1, Foot::kRight), 1);
  EXPECT_EQ(onto(2, Foot::kLeft), 2);
  EXPECT_EQ(onto(2, Foot::kRight), 3);
  const ClimbSummary s = climb.finish();
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_NEAR(s.climb_time_s, 4 * 0.400 + 3 * 0.100 - 0.002, 1e-9);
  EXPECT_EQ(s.footsteps.size(), 4U);
}

TEST(ClimbReport, PassingFoot_MustClearTheTreadItPasses) {
  for (const bool ends_in_the_air : {false, true}) {
    ScriptedClimb climb(plain_stairs(3));
    climb.wait(200 * kNsPerMs);
    climb.apex_m = 0.2;
    climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0);
    climb.swing(Foot::kRight, climb.on_step(1, Foot::kRight), 1);
    EXPECT_GT(climb.finish().swing_clearance_min_m, 0.0);
    if (ends_in_the_air) {
      climb.gait.step.sequence += 1;
      climb.gait.step.foot = Foot::kLeft;
      climb.gait.step.touch_down_stamp_ns = 0;
      climb.gait.step.target.position_m = climb.odom_T_true * climb.on_step(2, Foot::kLeft).p_m;
      climb.truth.in_contact[0] = false;
      climb.truth.true_T_sole[0].p_m = Vec3(0.28 - 0.179 + 0.004, 0.1, 0.20);  // 4 mm into step 2 on the way to step 3
      climb.tick();
      EXPECT_NEAR(climb.finish().swing_clearance_min_m, -0.004, kUm);
    } else {
      climb.apex_m = -0.14;  // as high as step 2 but for a centimetre
      climb.swing(Foot::kLeft, climb.on_step(2, Foot::kLeft), 2);
      EXPECT_LT(climb.finish().swing_clearance_min_m, -0.005);
      EXPECT_FALSE(climb.finish().pass);
      const std::vector<Footstep> steps = climb.finish().footsteps;
      EXPECT_EQ(steps.back().swing_clearance_m, climb.finish().swing_clearance_min_m);  // of that swing alone
      EXPECT_GT(steps.front().swing_clearance_m, 0.0);
    }
  }
}

TEST(ClimbReport, BriefTouch_IsNoRest) {
  ScriptedClimb climb(plain_stairs(1));
  climb.wait(100 * kNsPerMs);
  climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0);
  climb.swing(Foot::kRight, climb.on_step(0, Foot::kRight), 0);
  climb.wait(30 * kNsPerMs);
  EXPECT_EQ(climb.finish().steps_climbed, 0);
  climb.wait(30 * kNsPerMs);
  EXPECT_EQ(climb.finish().steps_climbed, 1);
}

TEST(ClimbReport, SwingClearance_SeesTheNextRiserButNotTheTreadsOfTheSwing) {
  ScriptedClimb climb(plain_stairs(2));
  climb.climb_all();
  // On step 1 the collision toe stands short of the riser of step 2; nothing else comes as near.
  EXPECT_NEAR(climb.finish().swing_clearance_min_m, 0.28 - (0.09 + 0.179), kUm);
}

TEST(ClimbReport, CollisionOfASingleTick_Fails) {
  for (const bool in_the_air : {true, false}) {
    for (int before = 0; before < 3; ++before) {
      ScriptedClimb climb(plain_stairs(3));
      climb.wait(100 * kNsPerMs);
      climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0);
      climb.swing(Foot::kRight, climb.on_step(0, Foot::kRight), 0);
      climb.wait(100 * kNsPerMs);
      climb.truth.in_contact[0] = !in_the_air;
      for (int i = 0; i < before; ++i) climb.tick();
      // The foot dips into step 3, which it neither leaves nor lands on.
      const Transform from = climb.truth.true_T_sole[0];
      climb.truth.true_T_sole[0].p_m = Vec3(0.56 - 0.179 + 0.003, 0.1, 0.30);
      climb.tick();
      climb.truth.true_T_sole[0] = from;
      climb.truth.in_contact[0] = true;
      climb.tick();
      const ClimbSummary s = climb.finish();
      EXPECT_NEAR(s.swing_clearance_min_m, -0.003, kUm) << in_the_air << before;
      EXPECT_FALSE(s.pass);
    }
  }
}

TEST(ClimbReport, StandOff_IsOfTheForemostToeBeforeAFootLeavesForTheStairs) {
  ScriptedClimb climb(plain_stairs(1, 0.02));
  climb.wait(100 * kNsPerMs);
  EXPECT_NEAR(climb.finish().stand_off_m, 0.3 - 0.02 - 0.179, kUm);
  Transform nearer = climb.truth.true_T_sole[0];
  nearer.p_m.x() += 0.05;
  climb.swing(Foot::kLeft, nearer, -1);
  climb.climb_all();
  EXPECT_NEAR(climb.finish().stand_off_m, 0.25 - 0.02 - 0.179, kUm);
}

TEST(ClimbReport, End_IsTheModulesOwnOrAFallOrTheTimeLimit) {
  ScriptedClimb climb(plain_stairs(1));
  climb.wait(100 * kNsPerMs);
  EXPECT_EQ(climb.finish().ended_by, "time limit");
  climb.climb_all();
  EXPECT_EQ(climb.finish().ended_by, "module");
  climb.truth.fell = true;
  climb.tick();
  EXPECT_EQ(climb.finish().ended_by, "fall");
}

TEST(ClimbReport, ClosureError_CountsOnBothFeetOnly) {
  ScriptedClimb climb(plain_stairs(1));
  for (const double error_m : {0.001, 0.002, 0.004}) {
    climb.truth.closure_error_m = error_m;
    climb.tick();
  }
  climb.truth.in_contact[0] = false;
  climb.truth.closure_error_m = 0.0;
  climb.wait(20 * kNsPerMs);
  EXPECT_DOUBLE_EQ(climb.finish().closure_error_m.median, 0.002);
  EXPECT_DOUBLE_EQ(climb.finish().closure_error_m.max, 0.004);
}

TEST(ClimbReport, RunEndingInTheAir_StillJudgesTheSwing) {
  ScriptedClimb climb(plain_stairs(3));
  climb.wait(100 * kNsPerMs);
  climb.gait.step.onto_tread = true;
  climb.truth.in_contact[0] = false;
  climb.truth.true_T_sole[0].p_m = Vec3(0.28 - 0.179 + 0.004, 0.1, 0.15);  // 4 mm into step 2 on the way to step 1
  climb.tick();
  EXPECT_NEAR(climb.finish().swing_clearance_min_m, -0.004, kUm);
}

TEST(ClimbReport, ExecutionError_IsThe3dDistanceOverStepsOntoTreads) {
  ScriptedClimb climb(plain_stairs(1));
  climb.wait(100 * kNsPerMs);
  Transform on_floor = climb.truth.true_T_sole[0];
  on_floor.p_m.x() += 0.05;
  climb.swing(Foot::kLeft, on_floor, -1, {.execution_m = Vec3(0.5, 0, 0)});  // on the floor: not counted
  climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0, {.execution_m = Vec3(0.002, 0.003, 0.006)});
  climb.swing(Foot::kRight, climb.on_step(0, Foot::kRight), 0, {.execution_m = Vec3(0, 0, 0.001)});
  const ClimbSummary s = climb.finish();
  EXPECT_NEAR(s.execution_error_m.max, 0.007, kUm);
  EXPECT_NEAR(s.execution_error_m.median, 0.004, kUm);
}

TEST(ClimbReport, FootholdError_TakesTheWorseOfAlongAndAcross) {
  ScriptedClimb climb(plain_stairs(1));
  climb.wait(100 * kNsPerMs);
  climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0, {.along_m = -0.008, .across_m = 0.003});
  climb.swing(Foot::kRight, climb.on_step(0, Foot::kRight), 0, {.along_m = 0.001, .across_m = -0.005});
  const ClimbSummary s = climb.finish();
  EXPECT_NEAR(s.footsteps[0].along_error_m, -0.008, kUm);
  EXPECT_NEAR(s.footsteps[0].across_error_m, 0.003, kUm);
  EXPECT_NEAR(s.foothold_error_along_m.max, 0.008, kUm);
  EXPECT_NEAR(s.foothold_error_across_m.max, 0.005, kUm);
  EXPECT_NEAR(s.foothold_error_m.max, 0.008, kUm);
  EXPECT_NEAR(s.foothold_error_m.median, 0.0065, kUm);
}

TEST(ClimbReport, FootholdError_IsMeasuredAlongATurnedFoot) {
  ScriptedClimb climb(plain_stairs(1, 0.02));
  climb.wait(100 * kNsPerMs);
  Transform turned = climb.on_step(0, Foot::kLeft, 0.1);
  turned.R = rotation_z(0.2);
  climb.swing(Foot::kLeft, turned, 0);
  // The script latched 0.1 m straight to the nosing (not the riser); along the foot's axis it is 0.1 / cos(0.2).
  EXPECT_NEAR(climb.finish().footsteps[0].along_error_m, 0.1 - 0.1 / std::cos(0.2), kUm);
}

// A passing foot that lands beside the standing one was sent there: it missed nothing.
TEST(ClimbReport, TargetChangedInTheAir_LandingIsScoredAgainstTheNewOne) {
  ScriptedClimb climb(plain_stairs(3));
  climb.wait(100 * kNsPerMs);
  climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0);
  LatchedStep& step = climb.gait.step;
  step.sequence = 2;
  step.foot = Foot::kRight;
  step.touch_down_stamp_ns = 0;
  Transform target = climb.on_step(1, Foot::kRight, 0.11);
  const auto aim = [&] {
    step.target.position_m = climb.odom_T_true * target.p_m;
    step.odom_T_target = climb.odom_T_true * target;
  };
  aim();
  step.target.nosing_distance_m = 0.11;
  climb.truth.in_contact[1] = false;
  climb.tick();
  target = climb.on_step(0, Foot::kRight);
  target.p_m.y() += 0.02;
  aim();
  step.target.nosing_distance_m = 0.0;
  step.height_mapped = false;
  climb.tick();
  climb.truth.in_contact[1] = true;
  climb.truth.step_index[1] = 0;
  climb.truth.true_T_sole[1] = target;
  climb.truth.true_T_sole[1].p_m.y() -= 0.003;
  step.touch_down_stamp_ns = climb.now_ns;
  step.odom_T_executed = step.odom_T_target;
  climb.tick();
  const ClimbSummary s = climb.finish();
  ASSERT_TRUE(s.footsteps[1].landed);
  EXPECT_NEAR((s.footsteps[1].true_T_planned.p_m - target.p_m).norm(), 0.0, kUm);
  EXPECT_TRUE(std::isnan(s.footsteps[1].along_error_m));
  EXPECT_NEAR(s.footsteps[1].across_error_m, 0.003, kUm);
  EXPECT_NEAR(s.foothold_error_m.max, 0.003, kUm);
  EXPECT_NEAR(s.foothold_error_along_m.max, 0.0, kUm);
}

TEST(ClimbReport, EarlyTouchDownReport_TakesTheTruthWhenTheSoleStands) {
  ScriptedClimb climb(plain_stairs(1));
  climb.wait(100 * kNsPerMs);
  climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0);
  ClimbReport& report = climb.report;
  // A second step is reported as down while its sole is still 50 mm short.
  climb.gait.step.sequence = 2;
  climb.gait.step.foot = Foot::kRight;
  climb.gait.step.target.nosing_distance_m = 0.09;
  climb.truth.in_contact[1] = false;
  climb.truth.true_T_sole[1] = climb.on_step(0, Foot::kRight, 0.04);
  climb.tick();
  EXPECT_FALSE(climb.finish().footsteps[1].landed);
  climb.truth.in_contact[1] = true;
  climb.truth.step_index[1] = 0;
  climb.truth.true_T_sole[1] = climb.on_step(0, Foot::kRight, 0.088);
  climb.tick();
  const ClimbSummary s = report.finish({});
  EXPECT_TRUE(s.footsteps[1].landed);
  EXPECT_NEAR(s.footsteps[1].along_error_m, 0.002, kUm);
}

TEST(ClimbReport, TrackingError_IsRelativeToTheStanceFootWhileSwinging) {
  ScriptedClimb climb(plain_stairs(1));
  climb.drift_m = Vec3(0.3, 0, 0);  // cancels: both feet move with it
  climb.climb_all({.tracking_m = Vec3(-0.012, 0.1, 0.007)});
  const ClimbSummary s = climb.finish();
  EXPECT_NEAR(s.tracking_error_x_max_m, 0.012, kUm);
  EXPECT_NEAR(s.tracking_error_z_max_m, 0.007, kUm);
}

TEST(ClimbReport, OdometryRmse_IsAlignedOnceAtTheFirstInitialisedTick) {
  ScriptedClimb climb(plain_stairs(1));
  climb.state.initialised = false;
  climb.drift_m = Vec3(0.5, 0.5, 0.5);  // before initialisation: aligned away
  climb.wait(20 * kTick_ns);
  climb.state.initialised = true;
  climb.wait(50 * kTick_ns);
  EXPECT_NEAR(climb.finish().odometry.rmse_base_m, 0.0, kUm);

  const Vec3 drift_m(0.003, 0.004, 0.0);
  climb.drift_m += drift_m;
  climb.wait(25 * kTick_ns);
  climb.state.world_T_odom.p_m -=
      climb.world_T_true().R * drift_m;  // LIO takes the drift out of the world, not of odom
  climb.wait(25 * kTick_ns);
  const ClimbSummary s = climb.finish();
  EXPECT_NEAR(s.odometry.rmse_base_m, 0.005 * std::sqrt(50.0 / 100.0), kUm);
  EXPECT_NEAR(s.odometry.rmse_fused_m, 0.005 * std::sqrt(25.0 / 100.0), kUm);
}

TEST(ClimbReport, LioRmse_ComparesAtTheStampOfTheScan) {
  ScriptedClimb climb(plain_stairs(1));
  const Transform lio_T_true{rotation_z(1.1), Vec3(10, 20, 0)};
  const auto lio = [&](std::int64_t stamp_ns, const Transform& true_T_base, const Vec3& error_m) {
    LioSample sample;
    sample.stamp_ns = stamp_ns;
    sample.lio_T_lidar = lio_T_true * true_T_base * base_T_lidar();
    sample.lio_T_lidar.p_m += error_m;
    return sample;
  };
  climb.tick();
  const Transform first = climb.truth.true_T_base;
  climb.report.observe_lio(lio(climb.now_ns, first, Vec3::Zero()));
  // The base moves 2 mm a tick; the pose is of the middle between two ticks and arrives 50 ticks later.
  climb.truth.true_T_base.p_m.x() += 0.002;
  climb.tick();
  const std::int64_t scan_ns = climb.now_ns - kTick_ns / 2;
  Transform between = first;
  between.p_m.x() += 0.001;
  climb.wait(50 * kTick_ns);
  climb.report.observe_lio(lio(scan_ns, between, Vec3(0, 0, 0.006)));
  EXPECT_NEAR(climb.finish().odometry.rmse_lio_m, 0.006 / std::sqrt(2.0), kUm);
  climb.report.observe_lio(lio(-5, between, Vec3(9, 9, 9)));  // no truth of that moment: not judged
  EXPECT_NEAR(climb.finish().odometry.rmse_lio_m, 0.006 / std::sqrt(2.0), kUm);
}

TEST(ClimbReport, Freshness_CountsFromTheExposure) {
  ScriptedClimb climb(plain_stairs(1));
  climb.wait(100 * kNsPerMs);
  climb.map.stamp_ns = climb.now_ns - 50 * kNsPerMs;
  climb.tick();
  climb.tick();  // the same map: counted once
  climb.map.stamp_ns = climb.now_ns - 60 * kNsPerMs;
  climb.tick();
  ClimbSummary s = climb.finish();
  EXPECT_DOUBLE_EQ(s.exposure_to_map_ms.max, 62.0);
  EXPECT_DOUBLE_EQ(s.exposure_to_map_ms.median, 57.0);

  // The left foot's tread was last seen 40 ms before the latch and never again: 398 ms of swing more at touch-down.
  climb.swing(Foot::kLeft, climb.on_step(0, Foot::kLeft), 0, {.map_age_ns = 70 * kNsPerMs});
  s = climb.finish();
  EXPECT_DOUBLE_EQ(s.map_age_at_latch_ms.max, 70.0);
  EXPECT_DOUBLE_EQ(s.target_last_seen_ms.max, 40.0 + 398.0);

  // The right foot's tread is seen again while it swings: the map says so.
  MapPolygon seen;
  seen.id = 1;
  seen.last_seen_ns = climb.now_ns + 300 * kNsPerMs;
  ASSERT_TRUE(climb.map.polygons.try_push_back(seen));
  climb.swing(Foot::kRight, climb.on_step(0, Foot::kRight), 0);
  s = climb.finish();
  EXPECT_DOUBLE_EQ(s.footsteps[1].target_last_seen_ms, 100.0);
}

// What is well in view from the scripted robot's start, as patches that perception should report.
std::vector<SurfacePatch> patches_in_view(const StairWorld& world, const Transform& true_T_camera) {
  std::vector<SurfacePatch> all;
  all.push_back(patch_of(true_T_camera, {-0.3, 0, 0}, Vec3::UnitZ(), Vec3(0.2, 0, 0), Vec3(0, 0.3, 0)));
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const Step& s = world.steps[k];
    all.push_back(patch_of(true_T_camera, {s.riser_x_m, 0, s.height_m - 0.06}, -Vec3::UnitX(), Vec3(0, 0.3, 0),
                           Vec3(0, 0, 0.05)));
    all.push_back(tread_patch(true_T_camera, world, k));
  }
  return all;
}

TEST(ClimbReport, PlaneRate_CountsFramesWhoseEverySurfaceIsTrueAndThatMissNone) {
  const StairWorld world = plain_stairs(3);
  ScriptedClimb climb(world);
  climb.tick();
  const Transform true_T_camera = climb.truth.true_T_base * base_T_camera();
  const std::int64_t exposure_ns = climb.now_ns;
  const auto frame = [&](const std::vector<SurfacePatch>& patches) {
    ++climb.surfaces.sequence;
    climb.surfaces.stamp_ns = exposure_ns;
    climb.surfaces.surfaces.clear();
    for (const SurfacePatch& patch : patches) ASSERT_TRUE(climb.surfaces.surfaces.try_push_back(patch));
    // Since the exposure the robot has moved: the pose of the exposure counts.
    climb.truth.true_T_base.p_m.x() += 0.2;
    climb.wait(32 * kNsPerMs);
  };
  const std::vector<SurfacePatch> all = patches_in_view(world, true_T_camera);
  std::vector<SurfacePatch> with_ghost = all;
  with_ghost.push_back(tread_patch(true_T_camera, world, 0, 0.07));
  frame(all);
  frame({all[0]});  // the floor alone
  frame(with_ghost);
  frame({});
  frame(all);
  const ClimbSummary s = climb.finish();
  EXPECT_EQ(s.frames, 5U);
  EXPECT_EQ(s.frames_matching, 2U);
  EXPECT_EQ(s.surfaces, 3 * all.size() + 2);
  EXPECT_EQ(s.surfaces_unmatched, 1U);
  EXPECT_GE(s.surfaces_in_view, 5 * 3U) << "floor, first riser and first tread at least";
  EXPECT_EQ(s.surfaces_missed, 2 * s.surfaces_in_view / 5 - 1)
      << "all of the blank frame, all but the floor of another";
  EXPECT_NEAR(s.plane_rate_hz, 2.0 / 0.160, 1e-9);
}

// Every step turned alike about the middle of its nosing.
StairWorld turned_stairs(double yaw_rad) {
  StairWorld world = plain_stairs(3);
  for (Step& step : world.steps) {
    const Vec3 nosing_m{step.nosing_x_m, 0.0, step.height_m};
    step.true_T_step = {rotation_z(yaw_rad), nosing_m - rotation_z(yaw_rad) * nosing_m};
  }
  return world;
}

TEST(ClimbReport, TurnedTread_FootholdErrorIsAlongTheTreadsOwnAxes) {
  constexpr double kYaw_rad = 0.1, kBehind_m = 0.09;
  const StairWorld world = turned_stairs(kYaw_rad);
  ScriptedClimb climb(world);
  climb.wait(200 * kNsPerMs);
  // As the tread is turned, its target at the middle of the nosing.
  const Transform target =
      world.steps[0].true_T_step * Transform{Mat3::Identity(), {world.steps[0].nosing_x_m + kBehind_m, 0.0, 0.13}};
  climb.swing(Foot::kLeft, target, 0);
  const double told_m = target.p_m.x() - world.steps[0].nosing_x_m;  // what the script says of a square tread
  EXPECT_NEAR(climb.finish().footsteps[0].along_error_m, told_m - kBehind_m, kUm);
  EXPECT_GT(std::abs(told_m - kBehind_m), 10 * kUm);
}

TEST(SurfaceMatch, TurnedTread_MatchesAsItIsTurned) {
  const double yaw_rad = 0.25;  // more than the angle that matches
  const StairWorld world = turned_stairs(yaw_rad);
  const Transform camera{rotation_y(0.3), Vec3(-0.4, 0, 0.8)}, &turn = world.steps[1].true_T_step;
  const auto matched = [&](const Transform& as) {
    return matching_surface(
        TrueSurfaces(world),
        patch_of(camera, as * Vec3(0.28, 0, 0.20), as.R * -Vec3::UnitX(), as.R * Vec3(0, 0.2, 0), Vec3(0, 0, 0.05)),
        camera);
  };
  EXPECT_EQ(matched(turn), 4);
  EXPECT_EQ(matched({}), kNoSurface);
}

TEST(SurfaceVisibility, LegBeforeATread_TakesItOutOfView) {
  const StairWorld world = plain_stairs(3);
  const Transform base{Mat3::Identity(), Vec3(-0.3, 0, 0.79)};
  SurfaceVisibility visibility(world, robot_camera_intrinsics());
  std::array<LegShapes, kFootCount> legs{};
  const std::vector<int> without = visibility.in_view(base * base_T_camera(), base_T_camera(), legs);
  EXPECT_NE(std::find(without.begin(), without.end(), 1), without.end());
  legs[0].thigh = {base_T_camera() * Vec3(-1, 0, 0.3), base_T_camera() * Vec3(1, 0, 0.3), 0.25};
  EXPECT_TRUE(visibility.in_view(base * base_T_camera(), base_T_camera(), legs).empty());
}

// Of a riser under a nosing 40 mm deep, seen from steeply above, a strip of each plane is left.
TEST(SurfaceVisibility, RiserSeenInStrips_IsNotWellInView) {
  const Transform base{Mat3::Identity(), Vec3(-0.45, 0, 0.79)};
  constexpr int kFirstRiser = 2;
  for (const double nosing_m : {0.0, 0.04}) {
    StairWorld world = plain_stairs(3);
    for (Step& step : world.steps) step.riser_x_m = step.nosing_x_m + nosing_m;
    SurfaceVisibility visibility(world, robot_camera_intrinsics());
    const std::vector<int> seen = visibility.in_view(base * base_T_camera(), base_T_camera(), {});
    EXPECT_EQ(std::find(seen.begin(), seen.end(), kFirstRiser) != seen.end(), nosing_m == 0.0) << nosing_m;
  }
}

TEST(SurfaceMatch, TrueSurfaces_MatchAndOthersDoNot) {
  const StairWorld world = plain_stairs(3);
  const Transform camera{rotation_y(0.3), Vec3(-0.4, 0, 0.8)};
  const auto matches = [&](const Vec3& centre_m, const Vec3& normal, const Vec3& u_m, const Vec3& v_m) {
    return matching_surface(TrueSurfaces(world), patch_of(camera, centre_m, normal, u_m, v_m), camera) != kNoSurface;
  };
  const Vec3 x(0.1, 0, 0), y(0, 0.2, 0), z(0, 0, 0.05);
  EXPECT_TRUE(matches({0.14, 0, 0.135}, Vec3::UnitZ(), x, y));                // tread, 5 mm high
  EXPECT_TRUE(matches({-0.3, 0.4, 0.0}, Vec3::UnitZ(), x, y));                // floor
  EXPECT_TRUE(matches({0.285, 0, 0.20}, -Vec3::UnitX(), y, z));               // riser of step 2
  EXPECT_TRUE(matches({0.14, 0.61, 0.06}, Vec3::UnitY(), x, z));              // left side
  EXPECT_FALSE(matches({0.14, 0, 0.20}, Vec3::UnitZ(), x, y));                // a foot's top
  EXPECT_FALSE(matches({0.14, 0, 0.135}, -Vec3::UnitZ(), x, y));              // from below
  EXPECT_FALSE(matches({0.14, 0, 0.0}, Vec3::UnitZ(), x, y));                 // the floor is not under the stairs
  EXPECT_FALSE(matches({0.3, 0, 0.0}, Vec3::UnitZ(), x, Vec3(0, 0.9, 0)));    // from one side to the other, under them
  EXPECT_TRUE(matches({0.3, 0.75, 0.0}, Vec3::UnitZ(), x, Vec3(0, 0.1, 0)));  // beside them
  EXPECT_FALSE(matches({0.20, 0, 0.06}, -Vec3::UnitX(), y, z));               // upright, amid a tread
  EXPECT_FALSE(matches({0.14, 0.9, 0.13}, Vec3::UnitZ(), x, y));              // beside the staircase
  const Vec3 sloped_x = rotation_y(-0.44) * x;
  EXPECT_FALSE(matches({0.14, 0, 0.13}, rotation_y(-0.44) * Vec3::UnitZ(), sloped_x, y));  // along the nosings
  const Vec3 tilted_x = rotation_y(-0.1) * Vec3(0.5, 0, 0);
  EXPECT_FALSE(matches({0.14, 0, 0.13}, rotation_y(-0.1) * Vec3::UnitZ(), tilted_x, y));  // leaves the plane by 50 mm
}

TEST(ClimbJson, Keys_StandInTheirOrderWithRoundedFigures) {
  ScriptedClimb climb(plain_stairs(1));
  climb.climb_all({.execution_m = Vec3(0.00123456, 0, 0)});
  RunFigures run;
  run.options.seed = 7;
  run.options.stairs.rise_m = 0.17;
  run.options.noise = NoiseKind::kCorrelated;
  run.options.render_missing_step = 1;
  run.static_memory = {{"estimation", 1000}, {"perception", 2000}};
  run.schedule = {{"sense", "control", 100.0, 500, 1, 12.34567, 99.0}};
  run.wall_seconds = 1.5;
  run.faults = {{"map_stale", 2}};
  const nlohmann::ordered_json j = to_json(climb.report.finish(run));
  std::string keys;
  for (const auto& [key, value] : j.items()) keys += key + " ";
  EXPECT_EQ(
      keys,
      "verdict reason fell ended_by ended_at_s plant gait seed command arguments params_hash reality camera states "
      "steps_total steps_climbed goal_reached footsteps_total surfaces_stood_on stood_on_wrongly body_clearance_mm_min "
      "overhang_mm_max stop_sentence climb_time_s seconds_per_step plane_rate_hz "
      "execution_error_mm foothold_error_mm sole_margin_mm_min swing_clearance_mm_min stand_off_mm "
      "closure_error_mm tracking_error_mm com_tracking_mm_max zmp_margin_mm_min torque_peak_ratio torque_limited_ms "
      "joint_speed_peak_ratio odometry_rmse_mm odometry_drift_mm odometry_jitter_mm odometry_nees "
      "occupied_cells_most exposure_to_map_ms "
      "map_age_at_latch_ms target_last_seen_ms heap_calls faults "
      "static_memory_bytes static_memory schedule surfaces footsteps wall ");
  EXPECT_EQ(j["verdict"], "pass");
  EXPECT_EQ(j["seed"], 7);
  EXPECT_EQ(
      j["arguments"].dump(),
      R"({"steps":10,"rise_m":0.17,"tread_m":0.28,"width_m":1.2,"nosing_m":0.0,"landing_m":1.0,"jitter_m":0.005,)"
      R"("noise":"correlated","camera":null,"scan_ms":16.0,"mount_error_deg":1.0,"scale_error":0.003,"params":null,)"
      R"("estimate_mount":true,"self_filter":true,"contacts":"inferred","pushes":[],"asked":[],"mass_scale":1.0,"torso_offset_x_m":0.0,"friction":0.8,"render_shift_m":[0.0,0.0,0.0],"render_missing_step":2,)"
      R"("blank_depth":false})");
  EXPECT_EQ(j["execution_error_mm"].dump(), R"({"median":1.23,"max":1.23})");
  EXPECT_EQ(j["odometry_rmse_mm"].dump(), R"({"base":0.0,"lio":null,"fused":0.0})");
  EXPECT_EQ(j["exposure_to_map_ms"].dump(), R"({"median":null,"max":null})");
  EXPECT_EQ(j["faults"].dump(), R"({"map_stale":2})");
  EXPECT_EQ(j["static_memory_bytes"], 3000);
  EXPECT_EQ(j["static_memory"].dump(), R"({"estimation":1000,"perception":2000})");
  EXPECT_EQ(j["schedule"].dump(), R"([{"task":"sense","lane":"control","budget_us":100.0,"runs":500,"overruns":1}])");
  EXPECT_EQ(j["wall"].dump(), R"({"seconds":1.5,"tasks":{"sense":{"mean_us":12.346,"max_us":99.0}}})");
}

TEST(ClimbJson, SameRun_SameBytesWhateverTheWallClock) {
  const auto text = [](double wall_seconds) {
    ScriptedClimb climb(plain_stairs(2));
    climb.climb_all({.execution_m = Vec3(0.001, 0.002, 0.003), .along_m = 0.004});
    RunFigures run;
    run.wall_seconds = wall_seconds;
    run.schedule = {{"sense", "control", 100.0, 500, 0, 10.0 * wall_seconds, 20.0 * wall_seconds}};
    nlohmann::ordered_json j = to_json(climb.report.finish(run));
    j.erase("wall");
    return j.dump();
  };
  EXPECT_EQ(text(1.0), text(2.0));
}

TEST(ClimbSvg, Drawing_HasEveryPartInTheTrueWorld) {
  ScriptedClimb climb(plain_stairs(2));
  climb.climb_all();
  MapPolygon polygon;
  polygon.id = 4;
  polygon.surface.kind = SurfaceKind::kTread;
  for (const Vec3& p : {Vec3(0, -0.4, 0.13), Vec3(0.28, -0.4, 0.13), Vec3(0.28, 0.4, 0.13)}) {
    ASSERT_TRUE(polygon.surface.polygon.try_push_back(climb.odom_T_true * p));
  }
  ASSERT_TRUE(climb.map.polygons.try_push_back(polygon));
  climb.map.stamp_ns = 1;
  climb.tick();
  const ClimbDrawing drawing = climb.report.drawing();
  ASSERT_EQ(drawing.polygons.size(), 1U);
  EXPECT_LT((drawing.polygons[0].vertices_m[1] - Vec3(0.28, -0.4, 0.13)).norm(), kUm);
  EXPECT_TRUE(drawing.polygons[0].remembered);
  climb.map.polygons.clear();
  climb.map.stamp_ns = 2;
  climb.tick();
  ASSERT_EQ(climb.report.drawing().polygons.size(), 1U);
  EXPECT_FALSE(climb.report.drawing().polygons[0].remembered);

  ClimbSummary summary = climb.finish();
  summary.reason = "a < b & \"c\"";
  const std::string svg = climb_svg(climb.report.world(), drawing, summary);
  EXPECT_NE(svg.find("a &lt; b &amp; &quot;c&quot;"), std::string::npos);
  for (const char* part : {"PASS", "Side", "From above", "planned foothold", "0.5 m", "2 of 2 steps climbed"}) {
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  }
  std::size_t dashed = 0;
  for (std::size_t at = svg.find("stroke-dasharray=\"5 3\""); at != std::string::npos;
       at = svg.find("stroke-dasharray=\"5 3\"", at + 1)) {
    ++dashed;
  }
  EXPECT_EQ(dashed, 2 * summary.footsteps.size() + 1) << "planned footholds in two views, one in the legend";
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg, climb_svg(climb.report.world(), drawing, summary));
}

TEST(ClimbSvg, Floor_IsDrawnBeneathTheStairsSeenFromAbove) {
  ClimbDrawing drawing;
  drawing.polygons.push_back({SurfaceKind::kTread, {Vec3(-1, -1, 0), Vec3(2, -1, 0), Vec3(2, 1, 0)}, true});
  drawing.polygons.push_back(
      {SurfaceKind::kTread, {Vec3(0, -0.5, 0.13), Vec3(0.2, -0.5, 0.13), Vec3(0.2, 0.5, 0.13)}, true});
  const std::string svg = climb_svg(plain_stairs(2), drawing, ClimbSummary{});
  const std::size_t above = svg.find("url(#above)");
  const std::size_t floor = svg.find("fill-opacity=\"0.16\"", above);
  const std::size_t stairs = svg.find("stroke-width=\"1.2\"", above);
  EXPECT_LT(floor, stairs);
  EXPECT_LT(stairs, svg.find("fill-opacity=\"0.16\"", stairs));
}

TEST(ClimbFiles, BadDirectory_ThrowsOneSentence) {
  ScriptedClimb climb(plain_stairs(1));
  climb.climb_all();
  const ClimbSummary summary = climb.finish();
  const std::string directory = testing::TempDir() + "polygmap_report_test";
  std::filesystem::create_directories(directory);
  write_climb_files(directory, climb.report, summary);
  std::ifstream file(directory + "/summary.json");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(nlohmann::json::parse(text.str())["steps_climbed"], 1);
  EXPECT_GT(std::filesystem::file_size(directory + "/climb.svg"), 1000U);
  EXPECT_THROW(write_climb_files(directory + "/summary.json", climb.report, summary), std::runtime_error);
}

}  // namespace
}  // namespace polygmap::sim
