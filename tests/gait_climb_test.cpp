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

// Times are integer ticks: summed up, they would make it another climb, or one sample that leaps.
TEST(GaitClimb, ClockAWeekOn_SamePlanBitForBit) {
  ClimbSetup setup;
  IdealClimb now(setup);
  setup.clock_ns = 7 * 24 * 3600 * kNsPerS;
  IdealClimb later(setup);
  while (now.tick()) {
    ASSERT_TRUE(later.tick());
    ASSERT_EQ(now.q_rad(), later.q_rad()) << now.tick_count();
  }
  EXPECT_EQ(now.status().phase, GaitPhase::kFinished);
}

TEST(GaitFinish, OnTop_StandsBetweenTheFeet) {
  IdealClimb climb({});
  climb.run(60.0);
  for (int i = 0; i < 500; ++i) climb.tick();
  const Vec3 middle = 0.5 * (climb.true_T_sole(Foot::kLeft).p_m + climb.true_T_sole(Foot::kRight).p_m);
  const Vec3 base_p_com = centre_of_mass_m({}, base_p_links_m({}, body_frames({}, climb.q_rad())));
  const Vec3 ahead_m{Gait::Params{}.step.zmp_ahead_m, 0, 0};
  EXPECT_LT((climb.true_T_base() * base_p_com - middle - ahead_m).head<2>().norm(), 0.005);
}

TEST(GaitReset, AfterAClimb_RepeatsItExactly) {
  IdealClimb first({}), second({});
  first.run(60.0);
  Gait gait;
  gait.reset({});
  second.gait() = first.gait();
  second.gait().reset({});
  second.run(60.0);
  ASSERT_EQ(first.record().steps.size(), second.record().steps.size());
  for (std::size_t i = 0; i < first.record().steps.size(); ++i) {
    EXPECT_EQ(first.record().steps[i].odom_T_executed.p_m, second.record().steps[i].odom_T_executed.p_m);
  }
}

TEST(TorsoTrajectory, EveryDuration_HeightHasNoLeapBetweenTwoTicks) {
  for (std::int32_t ticks = 1; ticks <= 1000; ++ticks) {
    const auto from = TorsoTrajectory::at_rest({Mat3::Identity(), Vec3{0, 0, 0.70}});
    TorsoTrajectory torso;
    torso.plan(from, 0.83, 0.0, ticks, ticks);
    const double most_mps2 = 5.78 * 0.13 / math::square(ticks * kTick_s);  // of a quintic between two rests
    for (std::int32_t tick = 0; tick <= ticks; ++tick) {
      const Motion z = torso.at(tick, {})[2];
      ASSERT_LE(std::abs(z.acceleration), most_mps2) << tick << " of " << ticks;
      ASSERT_GE(z.position, 0.70 - 1e-12);
      ASSERT_LE(z.position, 0.83 + 1e-12);
    }
    EXPECT_NEAR(torso.at(ticks, {})[2].position, 0.83, 1e-12);
  }
}

}  // namespace
}  // namespace polygmap
