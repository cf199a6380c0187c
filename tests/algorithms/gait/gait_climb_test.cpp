// SPDX-License-Identifier: Apache-2.0
// Whole climbs of an ideal robot, with errors of estimates, legs and map.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/gait_checks.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

using test::ClimbRecord;
using test::ClimbSetup;
using test::IdealClimb;

void expect_climbed(const IdealClimb& climb, const ClimbSetup& setup) {
  const ClimbRecord& r = climb.record();
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << static_cast<int>(climb.status().stop_reason);
  EXPECT_EQ(climb.status().treads_climbed, static_cast<std::uint32_t>(setup.stairs.steps));
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  test::expect_sound_commands(climb);
  EXPECT_LT(r.penetration_m, 0.002);  // of the contact itself
  EXPECT_GT(r.crossing_m, 0.02);
  EXPECT_GT(r.toe_gap_m, 0.02);
  EXPECT_GT(r.zmp_margin_m, 0.01);
  EXPECT_LT(r.execution_m, 0.003);
  const double per_stair_s = seconds(r.last_touch_down_ns - r.first_lift_off_ns) / setup.stairs.steps;
  EXPECT_GT(per_stair_s, 2.4);
  EXPECT_LT(per_stair_s, 3.7);
  EXPECT_GT(*std::min_element(r.sole_margin_m.begin(), r.sole_margin_m.end()), 0.0);
}

TEST(GaitClimb, RisesTreadsAndStarts_ClimbsToTheTopAndEnds) {
  constexpr double kDegree = kPi / 180;
  const std::array<std::array<double, 3>, 4> starts{
      {{0.35, 0.15, 10 * kDegree}, {0.8, -0.15, -10 * kDegree}, {0.5, 0.0, 0.0}, {0.65, 0.1, -8 * kDegree}}};
  std::size_t n = 0;
  for (const double rise : {0.10, 0.13, 0.17}) {
    for (const double tread : {0.275, 0.28, 0.285}) {
      for (const int steps : {4, 10}) {
        if (steps == 10 && rise == 0.10) continue;  // long climbs are for the corners
        if (test::kSlowMachine && (steps == 10 || tread != 0.28)) continue;
        ClimbSetup setup;
        setup.stairs = {.steps = steps, .rise_m = rise, .tread_m = tread};
        const auto& start = starts[n++ % starts.size()];
        setup.distance_m = start[0];
        setup.lateral_m = start[1];
        setup.yaw_rad = start[2];
        SCOPED_TRACE(testing::Message() << rise << " x " << tread << ", " << steps << " steps, start " << start[0]);
        IdealClimb climb(setup);
        climb.run(90.0);
        expect_climbed(climb, setup);
        EXPECT_LT(climb.record().execution_z_m, 0.003);
        EXPECT_EQ(climb.status().early_contacts + climb.status().late_contacts, 0U);
        EXPECT_LT(climb.record().swing_tracking_m, 0.004);
      }
    }
  }
}

TEST(GaitClimb, NoisyEstimatesAndFootholds_ClimbsAllTheSame) {
  for (const double sign : {-1.0, 1.0}) {
    ClimbSetup setup;
    setup.stairs.rise_m = 0.15;
    setup.estimate_tilt_rad = sign * 0.0035;
    setup.estimate_noise_m = 0.0003;
    setup.world_drift_mps = sign * 0.001;
    setup.foothold_noise_m = 0.0015;
    setup.lateral_m = 0.1 * sign;
    IdealClimb climb(setup);
    climb.run(60.0);
    expect_climbed(climb, setup);
    // The torso is levelled to what the estimator calls level, no less and no further.
    EXPECT_LT(climb.record().true_tilt_rad, 0.0035 * 1.5);
  }
}

TEST(GaitClimb, EstimateTilted_TiltDoesNotGrowWithTheSteps) {
  ClimbSetup setup;
  setup.stairs.steps = 10;
  setup.estimate_tilt_rad = 0.0035;
  IdealClimb climb(setup);
  climb.run(90.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_LT(climb.record().true_tilt_rad, 0.0055);
  EXPECT_LT(climb.record().execution_m, 0.003);
}

// Every leg has its own errors, so the base tilts whenever the weight changes feet; each swing levels it again.
TEST(GaitClimb, EncodersWithOffsets_TorsoIsLevelAtEveryTouchDown) {
  ClimbSetup setup;
  for (int i = 0; i < 12; ++i) setup.encoder_offset_rad[i] = i < 6 ? 2e-3 : -2e-3;
  IdealClimb climb(setup);
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_GT(climb.record().true_tilt_rad, 0.003);
  EXPECT_LT(climb.record().landed_tilt_rad, 0.001);
  EXPECT_LT(climb.record().execution_m, 0.004);
}

TEST(GaitClimb, StairsHigherThanMapped_TouchesEarlyAndClimbs) {
  ClimbSetup setup;
  setup.map_shift_z_m = -0.01;
  IdealClimb climb(setup);
  climb.run(60.0);
  expect_climbed(climb, setup);
  EXPECT_GE(climb.status().early_contacts, 4U);
}

TEST(GaitClimb, StairsLowerThanMapped_LowersTheFootAndClimbs) {
  ClimbSetup setup;
  setup.map_shift_z_m = 0.01;
  IdealClimb climb(setup);
  climb.run(60.0);
  expect_climbed(climb, setup);
  EXPECT_GE(climb.status().late_contacts, 4U);
}

TEST(GaitClimb, StairsNearerThanMapped_NeverTouchesARiser) {
  ClimbSetup setup;
  setup.map_shift_x_m = 0.009;
  setup.stairs.rise_m = 0.17;
  IdealClimb climb(setup);
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_LT(climb.record().penetration_m, 0.002);
}

}  // namespace
}  // namespace polygmap
