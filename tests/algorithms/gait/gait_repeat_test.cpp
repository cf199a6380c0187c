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
}  // namespace
}  // namespace polygmap
