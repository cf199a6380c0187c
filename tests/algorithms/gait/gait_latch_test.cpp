// SPDX-License-Identifier: Apache-2.0
// What is frozen at a lift-off, and what the last moment before it may still change.
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/gait_checks.hpp"

namespace polygmap {
namespace {

using test::disturb_after_the_first_tread;
using test::IdealClimb;
using test::kOnTheFirstTread;

TEST(GaitLatch, FootholdsMoveInMidSwing_TargetStaysFrozen) {
  IdealClimb climb({});
  bool in_swing = false;
  climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
    if (in_swing) {
      for (Foothold& hold : set.p_star_feet) hold.position_m += Vec3{0.05, 0.05, 0.02};
    }
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 1));
  const LatchedStep latched = climb.status().step;
  EXPECT_EQ(latched.touch_down_stamp_ns, 0);
  EXPECT_GT(latched.map_stamp_ns, 0);
  EXPECT_EQ(latched.latch_stamp_ns, climb.status().stamp_ns);
  in_swing = true;
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 1));
  const LatchedStep landed = climb.status().step;
  EXPECT_EQ(landed.odom_T_target.p_m, latched.odom_T_target.p_m);
  EXPECT_EQ(landed.target.position_m, latched.target.position_m);
  EXPECT_GT(landed.touch_down_stamp_ns, latched.latch_stamp_ns);
  EXPECT_LT((landed.odom_T_executed.p_m - latched.odom_T_target.p_m).norm(), 0.003);
}

TEST(GaitLatch, SmallChangeBeforeLiftOff_IsAbsorbedAndALargeOneCostsANewShift) {
  for (const double change : {0.012, 0.03}) {
    IdealClimb climb({});
    std::int64_t changed_ns = std::numeric_limits<std::int64_t>::max();
    climb.tamper = [&](StateEstimate& state, FootholdSet& set, JointFeedback&) {
      if (state.stamp_ns < changed_ns) return;
      for (Foothold& hold : set.p_star_feet) hold.position_m += rotation_z(hold.yaw_rad) * Vec3{-change, 0, 0};
    };
    std::uint32_t floor_steps = 0;
    while (climb.tick() && !climb.status().step.onto_tread) floor_steps = climb.status().step.sequence;
    ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, floor_steps + 2));  // both on the first tread
    const std::int64_t landed_ns = climb.status().stamp_ns;
    changed_ns = landed_ns + 200 * kNsPerMs;  // in the middle of the shift
    ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, floor_steps + 3));
    const double shift_s = seconds(climb.status().stamp_ns - landed_ns);
    if (change < 0.015) {
      EXPECT_LT(shift_s, 0.5);
    } else {
      EXPECT_GT(shift_s, 0.6);
      EXPECT_LT(shift_s, 0.85);
    }
  }
}

// Just lined up (4 mm) when the weight sets off, and just not any more when the foot might leave.
TEST(GaitLatch, StandOffALittleOffDuringTheFirstShift_IsNoReasonToLineUpAgain) {
  std::uint32_t floor_steps = 0;
  for (const double off_m : {0.0, -0.0046, 0.0046}) {
    IdealClimb climb({});
    climb.tamper = [&](StateEstimate& state, FootholdSet& set, JointFeedback&) {
      const LatchedStep& step = climb.status().step;
      if (off_m == 0.0 || step.sequence < floor_steps || step.touch_down_stamp_ns == 0) return;
      if (state.stamp_ns - step.touch_down_stamp_ns < 100 * kNsPerMs) return;
      const Vec3 shift_m = rotation_z(set.p_star_feet[0].yaw_rad) * Vec3{off_m, 0, 0};
      for (Vec3* p : {&set.p_star_feet[0].position_m, &set.p_star_feet[1].position_m, &set.tread.nosing_a_m,
                      &set.tread.nosing_b_m}) {
        *p += shift_m;
      }
    };
    while (climb.tick() && !climb.status().step.onto_tread) {
    }
    if (off_m == 0.0) floor_steps = climb.status().step.sequence - 1;
    EXPECT_EQ(climb.status().step.sequence, floor_steps + 1) << off_m;
  }
}

TEST(GaitLatch, LostFootholdsAfterTheLeadingFoot_TrailingFootUsesTheMemory) {
  IdealClimb climb({});
  bool blind = false;
  climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
    if (blind) set = {};
  };
  while (climb.tick() && !climb.status().step.onto_tread) {
  }
  ASSERT_EQ(climb.status().phase, GaitPhase::kSwing);
  blind = true;  // the leading foot is in the air
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kNothingSeen);
  EXPECT_EQ(climb.status().treads_climbed, 1U);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
  EXPECT_NEAR(climb.true_T_sole(Foot::kLeft).p_m.x(), climb.true_T_sole(Foot::kRight).p_m.x(), 0.003);
  EXPECT_LT(climb.record().execution_m, 0.003);
}

// The target moves aside just before the lift-off, and with it the rule which foot leads.
TEST(GaitLatch, OtherFootLeadsAfterTheShift_WeightTakesTheTimeOfAWholeShift) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    const double off_m = since_ns < 100 * kNsPerMs ? 0.03 : -0.03;
    for (Foothold& hold : set.p_star_feet) hold.position_m += rotation_z(hold.yaw_rad) * Vec3{0, off_m, 0};
  });
  const auto swings_from_the_first_tread = [&] {
    return climb.status().treads_climbed == kOnTheFirstTread && climb.status().phase == GaitPhase::kSwing;
  };
  while (climb.tick() && !swings_from_the_first_tread()) {
  }
  EXPECT_EQ(climb.status().step.foot, Foot::kRight);
  const std::int64_t stood_ns = climb.record().steps.back().touch_down_stamp_ns;
  EXPECT_GT(seconds(climb.status().step.latch_stamp_ns - stood_ns),
            0.62 + 0.5);  // another one over the same foot takes 0.25 s
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  test::expect_sound_commands(climb);
}

}  // namespace
}  // namespace polygmap
