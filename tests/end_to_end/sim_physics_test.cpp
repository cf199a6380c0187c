// SPDX-License-Identifier: Apache-2.0
// The whole module under physics, perception in the loop: climbs and stops in both of its gaits, and with another body
// or ground than it believes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <tuple>
#include <vector>

#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

Params params_of(bool single_step) {
  Params params;
  params.gait.planner.pattern = single_step ? GaitPattern::kSingleStep : GaitPattern::kDoubleStep;
  return params;
}
// Enough of them that a step is left after those that the tests look at.
SimOptions stairs_for(bool single_step, std::uint64_t seed) { return stairs_of(single_step ? 4 : 2, seed); }
std::string short_name(bool single_step) { return single_step ? "ss" : "ds"; }

TEST(PhysicalClimb, TwoSteps_ClimbsAndStands) {
  PhysicalClimb climb(stairs_of(2, 1));
  climb.run(60.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 2U);
  EXPECT_GE(climb.sole_margin_min_m(), 0.0);
  EXPECT_EQ(climb.truth().step_index[0], 1);
  EXPECT_EQ(climb.truth().step_index[1], 1);
  EXPECT_TRUE(stands_for(climb, 1.0)) << climb.com_error_m();
}

TEST(PhysicalClimb, ImuPitchedOrRolledByTwoDegrees_ClimbsAndTellsOfIt) {
  for (const Vec3& turned_rad : {Vec3{0.0, 0.035, 0.0}, Vec3{0.0, -0.035, 0.0}, Vec3{-0.035, 0.0, 0.0}}) {
    SimOptions options = stairs_of(2, 5);
    options.errors.imu_turned_rad = turned_rad;
    PhysicalClimb climb(options);
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 2U);
    EXPECT_GE(climb.sole_margin_min_m(), 0.0);
    EXPECT_EQ(climb.health().count(Limit::kImuTurned).count, 1U);
  }
}

// The balance had learnt to hold the body by the wrong attitude, 26 mm off. Told of the turn, it holds it as before.
TEST(PhysicalClimb, ImuIsFoundToBePitched_BodyIsNotJolted) {
  for (const double pitch_rad : {0.035, -0.035}) {
    SimOptions options = stairs_of(2, 5);
    options.errors.imu_turned_rad.y() = pitch_rad;
    PhysicalClimb climb(options);
    while (climb.time_s() < 5.0 && climb.health().count(Limit::kImuTurned).count == 0) ASSERT_TRUE(climb.tick());
    const Vec3 before_m = climb.truth().true_p_com_m;
    double moved_m = 0.0;
    for (int i = 0; i < 150; ++i) {
      ASSERT_TRUE(climb.tick());
      moved_m = std::max(moved_m, (climb.truth().true_p_com_m - before_m).head<2>().norm());
    }
    EXPECT_LT(moved_m, 4e-3) << pitch_rad;
  }
}

TEST(PhysicalRepetition, SameSeedTwice_RepeatsBitForBit) {
  PhysicalClimb one(stairs_of(2, 2)), two(stairs_of(2, 2));
  one.run(6.0);
  two.run(6.0);
  EXPECT_EQ(one.truth().true_T_base.p_m, two.truth().true_T_base.p_m);
  EXPECT_GT(one.status().step.sequence, 1U);
}

// The module believes the data sheet's body and knows nothing of the ground.
struct Body {
  const char* name;
  double mass_scale, offset_x_m, friction;
};
constexpr Body kBodies[]{{"lighter", 0.9, 0.0, 0.8},
                         {"heavier", 1.2, 0.0, 0.8},
                         {"behind", 1.0, -0.015, 0.8},
                         {"ahead", 1.0, 0.030, 0.8},
                         {"slippery", 1.0, 0.0, 0.4}};
struct BodyCase {
  Body body;
  std::uint64_t seed;
};
void PrintTo(const BodyCase& c, std::ostream* out) { *out << c.body.name << ", seed " << c.seed; }
std::string body_name(const testing::TestParamInfo<BodyCase>& info) {
  return info.param.body.name + ("_seed" + std::to_string(info.param.seed));
}
class OtherBody : public testing::TestWithParam<BodyCase> {};

TEST_P(OtherBody, ThanBelieved_ClimbsAllTheSame) {
  const auto& [body, seed] = GetParam();
  SimOptions options = stairs_of(2, seed);
  options.mujoco.torso_mass_scale = body.mass_scale;
  options.mujoco.torso_offset_x_m = body.offset_x_m;
  options.mujoco.friction = body.friction;
  PhysicalClimb climb(options);
  climb.run(30.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 2U);
  EXPECT_GE(climb.sole_margin_min_m(), 0.0);
}

std::vector<BodyCase> each_body_once() {
  std::vector<BodyCase> cases;
  for (const Body& body : kBodies) cases.push_back({body, cases.size() + 1});
  return cases;
}
std::vector<BodyCase> every_body() {
  std::vector<BodyCase> cases;
  for (const Body& body : kBodies) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) cases.push_back({body, seed});
  }
  return cases;
}
INSTANTIATE_TEST_SUITE_P(Seeds, OtherBody, testing::ValuesIn(each_body_once()), body_name);
INSTANTIATE_TEST_SUITE_P(Long, OtherBody, testing::ValuesIn(every_body()), body_name);

// In single steps; seed; in which swing onto a tread; after how much of it, s.
using StopCase = std::tuple<bool, std::uint64_t, std::uint32_t, double>;
std::string stop_name(const testing::TestParamInfo<StopCase>& info) {
  const auto [single_step, seed, nth, after_s] = info.param;
  return short_name(single_step) + std::to_string(seed) + "_swing" + std::to_string(nth) + "_" +
         std::to_string(std::lround(1e3 * after_s)) + "ms";
}
class StopRequested : public testing::TestWithParam<StopCase> {};

TEST_P(StopRequested, AfterALiftOff_EndsOnBothFeet) {
  const auto [single_step, seed, nth, after_s] = GetParam();
  PhysicalClimb climb(stairs_for(single_step, seed), params_of(single_step));
  ASSERT_TRUE(run_to_swing_onto(climb, nth));
  climb.run(after_s);
  climb.request_stop();
  const double asked_s = climb.time_s();
  while (!(climb.status().stands[0] && climb.status().stands[1]) && climb.tick()) {
  }
  EXPECT_LE(climb.time_s() - asked_s, 1.0);
  climb.run(5.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
  EXPECT_GE(climb.sole_margin_min_m(), 0.0);
  EXPECT_TRUE(stands_for(climb, 3.0)) << climb.com_error_m() << climb.truth().fall_reason;
}
constexpr std::array kStopsAfter_s{0.0, 0.03, 0.06, 0.09, 0.3, 0.6, 0.9, 1.2};
INSTANTIATE_TEST_SUITE_P(Double, StopRequested,
                         testing::Combine(testing::Values(false), testing::Values(2U), testing::Values(2U),
                                          testing::ValuesIn(kStopsAfter_s)),
                         stop_name);
INSTANTIATE_TEST_SUITE_P(Single, StopRequested,
                         testing::Combine(testing::Values(true), testing::Values(2U), testing::Values(3U),
                                          testing::ValuesIn(kStopsAfter_s)),
                         stop_name);
// 2026-11-27: back down to the lower tread 4 of these 180 fell, and 3 stood over an edge.
INSTANTIATE_TEST_SUITE_P(Long, StopRequested,
                         testing::Combine(testing::Bool(), testing::Range<std::uint64_t>(1, 7),
                                          testing::Values(1U, 2U, 3U), testing::Values(0.0, 0.03, 0.05, 0.07, 0.09)),
                         stop_name);

using LossCase = std::tuple<bool, bool, std::uint32_t>;  // in single steps; no frames, not blank ones; in which swing
std::string loss_name(const testing::TestParamInfo<LossCase>& info) {
  const auto [single_step, silent, nth] = info.param;
  return short_name(single_step) + (silent ? "_silent_swing" : "_blank_swing") + std::to_string(nth);
}
class PerceptionLost : public testing::TestWithParam<LossCase> {};

TEST_P(PerceptionLost, InASwing_FinishesTheStepAndStandsOnBothFeet) {
  const auto [single_step, silent, nth] = GetParam();
  PhysicalClimb climb(stairs_for(single_step, 2), params_of(single_step));
  ASSERT_TRUE(run_to_swing_onto(climb, nth));
  (silent ? climb.camera.silent : climb.camera.blank) = true;
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kMapStale);
  EXPECT_EQ(climb.status().treads_climbed, single_step ? nth : 1U);
  EXPECT_GE(climb.sole_margin_min_m(), 0.0);
  EXPECT_TRUE(stands_for(climb, 3.0)) << climb.com_error_m() << climb.truth().fall_reason;
  EXPECT_EQ(climb.truth().step_index[0], climb.truth().step_index[1]);
}
INSTANTIATE_TEST_SUITE_P(Double, PerceptionLost,
                         testing::Combine(testing::Values(false), testing::Bool(), testing::Values(1U, 2U)), loss_name);
INSTANTIATE_TEST_SUITE_P(Single, PerceptionLost,
                         testing::Combine(testing::Values(true), testing::Bool(), testing::Values(1U, 2U, 3U)),
                         loss_name);

// The search is told to allow what the legs cannot do.
TEST(PhysicalStop, StepBeyondTheLegs_StandsOnBothFeetAndSaysSo) {
  // Of two as steep the search says itself that they are too high.
  for (const auto& [steps, reason] : {std::pair{1, StopReason::kLegsCannot}, std::pair{2, StopReason::kRiseTooHigh}}) {
    SimOptions options = stairs_of(steps, 2);
    options.stairs.rise_m = 0.30;
    Params params;
    params.footholds.rise_max_m = 0.40;
    PhysicalClimb climb(options, params);
    climb.run(40.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, reason);
    EXPECT_TRUE(stands_for(climb, 3.0)) << climb.com_error_m() << climb.truth().fall_reason;
  }
}

TEST(PhysicalSingleStep, FourSteps_OneFootOnEveryStepAndBothOnTheLast) {
  PhysicalClimb climb(stairs_of(4, 1), params_of(true));
  climb.run(60.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 4U);
  EXPECT_GE(climb.sole_margin_min_m(), 0.0);
  EXPECT_EQ(climb.truth().step_index[0], 3);
  EXPECT_EQ(climb.truth().step_index[1], 3);
  EXPECT_TRUE(stands_for(climb, 1.0)) << climb.com_error_m();
}

}  // namespace
}  // namespace polygmap::sim
