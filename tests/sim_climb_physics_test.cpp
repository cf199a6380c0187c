// SPDX-License-Identifier: Apache-2.0
// Whole climbs under physics, perception in the loop, with every error on: one in the normal check, the sweep behind
// --long.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "sim_stub/climb.hpp"

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

ClimbSummary climb(const Case& c) {
  ClimbOptions options;
  options.plant = PlantKind::kMujoco;
  options.seed = c.seed;
  options.stairs = c.stairs;
  options.noise = c.seed % 2 == 0 ? DepthNoise::kCorrelated : DepthNoise::kWhite;
  return run_climb(options, {});
}

double share_on_their_treads(const ClimbSummary& summary) {
  double steps = 0.0, inside = 0.0;
  for (const Footstep& step : summary.footsteps) {
    if (!step.onto_tread) continue;
    steps += 1.0;
    inside += step.sole_margin_m >= 0.0 ? 1.0 : 0.0;
  }
  return inside / steps;
}

class PhysicsClimb : public testing::TestWithParam<Case> {};

TEST_P(PhysicsClimb, DoubleStep_ClimbedWithinTheFigures) {
  const ClimbSummary summary = climb(GetParam());
  EXPECT_FALSE(summary.fell) << summary.reason;
  EXPECT_EQ(summary.steps_climbed, GetParam().stairs.steps) << summary.reason;
  EXPECT_EQ(summary.ended_by, "module");
  EXPECT_GT(summary.swing_clearance_min_m, 0.0);
  if (GetParam().timed) EXPECT_LE(summary.seconds_per_step, 2.7);
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    EXPECT_LE(summary.torque_peak_ratio[j], 1.0) << j;
    EXPECT_LE(summary.joint_speed_peak_ratio[j], 1.0) << j;
  }
  EXPECT_LE(summary.foothold_error_m.max, 0.012);
  EXPECT_LE(summary.foothold_error_m.median, 0.005);
  EXPECT_LE(summary.execution_error_m.max, 0.010);
  EXPECT_LE(summary.tracking_error_x_max_m, 0.030);
  EXPECT_LE(summary.tracking_error_z_max_m, 0.030);
  EXPECT_GE(summary.sole_margin_min_m, -0.005);
  EXPECT_GE(share_on_their_treads(summary), 0.95);
  EXPECT_EQ(summary.heap_calls, 0U);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PhysicsClimb, testing::Values(Case{3, {.steps = 4}}), name_of);

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

}  // namespace
}  // namespace polygmap::sim
