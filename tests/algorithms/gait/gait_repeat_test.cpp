// SPDX-License-Identifier: Apache-2.0
// What must come out to the bit, on every processor: the same plan from any clock and after a reset.
#include <gtest/gtest.h>

#include "tests/support/ideal_climb.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

using test::ClimbSetup;
using test::IdealClimb;

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
  gait.reset({}, nominal_robot());
  second.gait() = first.gait();
  second.gait().reset({}, nominal_robot());
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
