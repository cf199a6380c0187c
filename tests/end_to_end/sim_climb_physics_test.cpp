// SPDX-License-Identifier: Apache-2.0
// Whole climbs under physics, perception in the loop, with every error on: one in the normal check, the sweep behind
// --long.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <tuple>
#include <vector>

#include "sim_stub/host/climb/climb.hpp"

namespace polygmap::sim {
namespace {

struct Case {
  std::uint64_t seed = 1;
  StairParams stairs;
  bool timed = true;  // not on other stairs than those of 0.13 x 0.28 m
};

// The name says it all; the default prints bytes, padding included.
void PrintTo(const Case& c, std::ostream* out) { *out << "seed " << c.seed; }
std::string name_of(const testing::TestParamInfo<Case>& info) {
  const auto mm = [](double length_m) { return std::to_string(std::lround(length_m * 1000)); };
  const StairParams& stairs = info.param.stairs;
  return "seed" + std::to_string(info.param.seed) + "_steps" + std::to_string(stairs.steps) + "_rise" +
         mm(stairs.rise_m) + "_tread" + mm(stairs.tread_m) + "_jitter" + mm(stairs.jitter_m);
}

ClimbSummary climb(const Case& c, GaitPattern gait, ClimbOptions options = {}) {
  options.gait = gait;
  options.seed = c.seed;
  options.stairs = c.stairs;
  options.noise = c.seed % 2 == 0 ? NoiseKind::kCorrelated : NoiseKind::kWhite;
  return run_climb(options, {});
}

int steps_onto_treads(const ClimbSummary& summary) {
  return static_cast<int>(std::ranges::count(summary.footsteps, true, &Footstep::onto_tread));
}

// What either gait must show. On the largest stairs of the range the knee that is bent most has nothing to spare, and
// for a moment gives all that its drive has: in 3 of 16 seeds (2026-11).
void expect_climbed(const ClimbSummary& summary, const StairParams& stairs) {
  const int steps = stairs.steps;
  const bool largest = stairs.rise_m >= 0.17 && stairs.tread_m >= 0.35;
  EXPECT_FALSE(summary.fell) << summary.reason;
  EXPECT_EQ(summary.steps_climbed, steps) << summary.reason;
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_GT(summary.swing_clearance_min_m, 0.0);
  EXPECT_LE(summary.torque_limited_ms, largest ? 20.0 : 0.0);
  EXPECT_LE(*std::ranges::max_element(summary.joint_speed_peak_ratio), 1.0);
  EXPECT_EQ(summary.heap_calls, 0U);
}

class PhysicsClimb : public testing::TestWithParam<Case> {};

TEST_P(PhysicsClimb, DoubleStep_ClimbedWithinTheFigures) {
  const ClimbSummary summary = climb(GetParam(), GaitPattern::kDoubleStep);
  expect_climbed(summary, GetParam().stairs);
  if (GetParam().timed) {
    EXPECT_LE(summary.seconds_per_step, 2.7);
  }
  EXPECT_LE(summary.foothold_error_m.max, 0.012);
  EXPECT_LE(summary.foothold_error_m.median, 0.005);
  EXPECT_LE(summary.execution_error_m.max, 0.010);
  EXPECT_LE(summary.tracking_error_x_max_m, 0.030);
  EXPECT_LE(summary.tracking_error_z_max_m, 0.030);
  EXPECT_GE(summary.sole_margin_min_m, 0.0);
}

class SingleStepClimb : public testing::TestWithParam<Case> {};

TEST_P(SingleStepClimb, UnderPhysics_ClimbedWithinTheFigures) {
  const ClimbSummary summary = climb(GetParam(), GaitPattern::kSingleStep);
  expect_climbed(summary, GetParam().stairs);
  // One for each, and the foot that comes beside the last one.
  EXPECT_EQ(steps_onto_treads(summary), GetParam().stairs.steps + 1);
  EXPECT_LE(summary.seconds_per_step, 1.6);
  EXPECT_LE(summary.execution_error_m.max, 0.010);  // the paper: 0.0334
  EXPECT_LE(summary.foothold_error_m.max, 0.0124);
  EXPECT_LE(summary.tracking_error_x_max_m, 0.030);
  EXPECT_GE(summary.sole_margin_min_m, 0.0);
}

// The IMU of a Livox Mid-360: 200 Hz, of which no sample falls on every second cycle.
class SlowImuClimb : public testing::TestWithParam<std::tuple<PlantKind, GaitPattern, std::uint64_t>> {};

TEST_P(SlowImuClimb, ImuOf200Hz_ClimbedWithoutOneMissed) {
  const auto& [plant, gait, seed] = GetParam();
  ClimbOptions options;
  options.plant = plant;
  options.params.imu_interval_ns = 5 * kNsPerMs;
  const ClimbSummary summary = climb({seed, {.steps = 4}}, gait, options);
  EXPECT_FALSE(summary.fell) << summary.reason;
  EXPECT_EQ(summary.steps_climbed, 4) << summary.reason;
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_LE(summary.foothold_error_m.max, 0.0124);
  EXPECT_GE(summary.sole_margin_min_m, 0.0);
  EXPECT_TRUE(std::ranges::none_of(summary.faults, [](const auto& fault) { return fault.first == "imu_missing"; }));
}

INSTANTIATE_TEST_SUITE_P(Seeds, SlowImuClimb,
                         testing::Values(std::tuple{PlantKind::kMujoco, GaitPattern::kDoubleStep, 3U},
                                         std::tuple{PlantKind::kKinematic, GaitPattern::kDoubleStep, 3U},
                                         std::tuple{PlantKind::kMujoco, GaitPattern::kSingleStep, 2U}));
INSTANTIATE_TEST_SUITE_P(Long, SlowImuClimb,
                         testing::Combine(testing::Values(PlantKind::kMujoco, PlantKind::kKinematic),
                                          testing::Values(GaitPattern::kDoubleStep, GaitPattern::kSingleStep),
                                          testing::Range(std::uint64_t{1}, std::uint64_t{11})));

INSTANTIATE_TEST_SUITE_P(Seeds, PhysicsClimb,
                         testing::Values(Case{3, {.steps = 4}},
                                         Case{60, {.steps = 4, .tread_m = 0.27, .jitter_m = 0.0}, false}),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Seeds, SingleStepClimb, testing::Values(Case{2, {.steps = 4}}), name_of);

std::vector<Case> long_cases() {
  std::vector<Case> cases;
  for (const int steps : {4, 10}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) cases.push_back({seed, {.steps = steps}});
  }
  std::uint64_t seed = 1;
  for (const double rise_m : {0.10, 0.12, 0.15, 0.17}) {
    for (const double tread_m : {0.28, 0.31, 0.35}) {
      cases.push_back({seed++, {.rise_m = rise_m, .tread_m = tread_m}, false});
    }
    cases.push_back({seed++, {.rise_m = rise_m, .tread_m = 0.27, .jitter_m = 0.0}, false});
  }
  return cases;
}
INSTANTIATE_TEST_SUITE_P(Long, PhysicsClimb, testing::ValuesIn(long_cases()), name_of);

std::vector<Case> twenty_seeds() {
  std::vector<Case> cases;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) cases.push_back({seed, {}});
  return cases;
}
INSTANTIATE_TEST_SUITE_P(Long, SingleStepClimb, testing::ValuesIn(twenty_seeds()), name_of);

}  // namespace
}  // namespace polygmap::sim
