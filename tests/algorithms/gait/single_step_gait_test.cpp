// SPDX-License-Identifier: Apache-2.0
// One foot on every tread: which foot goes where, and what it falls back on.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/ideal_climb.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

using test::ClimbRecord;
using test::ClimbSetup;
using test::IdealClimb;

Gait::Params single_step() {
  Gait::Params params;
  params.planner.pattern = GaitPattern::kSingleStep;
  return params;
}

std::vector<LatchedStep> onto_treads(const IdealClimb& climb) {
  std::vector<LatchedStep> steps = climb.record().steps;
  std::erase_if(steps, [](const LatchedStep& step) { return !step.onto_tread; });
  return steps;
}
// The footholds' ids say which tread it was, from 1.
std::vector<int> treads_of(const IdealClimb& climb) {
  std::vector<int> treads;
  for (const LatchedStep& step : onto_treads(climb)) treads.push_back(static_cast<int>(step.target.polygon_id) - 9);
  return treads;
}
void expect_sound(const IdealClimb& climb) {
  const ClimbRecord& r = climb.record();
  EXPECT_LE(*std::max_element(r.speed_share.begin(), r.speed_share.end()), 1.0 + 1e-9);
  EXPECT_GE(r.joint_margin_rad, 0.0);
  EXPECT_GE(r.knee_min_rad, 0.05);
  EXPECT_LT(r.penetration_m, 0.002);
  EXPECT_GT(r.zmp_margin_m, 0.01);
  EXPECT_LT(r.execution_m, 0.004);
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
}
bool in_swing(const IdealClimb& climb, std::size_t nth_onto_tread) {
  return climb.status().phase == GaitPhase::kSwing && climb.status().step.onto_tread &&
         onto_treads(climb).size() + 1 == nth_onto_tread;
}
void run_to_swing(IdealClimb& climb, std::size_t nth_onto_tread) {
  while (!in_swing(climb, nth_onto_tread) && climb.tick()) {
  }
  ASSERT_TRUE(in_swing(climb, nth_onto_tread));
}

TEST(SingleStepGait, RisesAndTreads_FeetTakeTurnsUpToTheTop) {
  for (const double rise_m : {0.10, 0.13, 0.17}) {
    for (const double tread_m : {0.275, 0.285}) {
      ClimbSetup setup;
      setup.stairs = {.steps = 5, .rise_m = rise_m, .tread_m = tread_m};
      setup.yaw_rad = 0.1;
      IdealClimb climb(setup, single_step());
      climb.run(60.0);
      SCOPED_TRACE(testing::Message() << rise_m << " x " << tread_m);
      EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
      EXPECT_EQ(climb.status().treads_climbed, 5U);
      EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 2, 3, 4, 5, 5}));
      const std::vector<LatchedStep> steps = onto_treads(climb);
      for (std::size_t i = 1; i < steps.size(); ++i) EXPECT_NE(steps[i].foot, steps[i - 1].foot) << i;
      expect_sound(climb);
      EXPECT_GT(climb.record().crossing_m, 0.015);
      const double per_stair_s = seconds(climb.record().last_touch_down_ns - climb.record().first_lift_off_ns) / 5;
      EXPECT_LT(per_stair_s, 1.6);
    }
  }
}

// Between touch-down and the next lift-off there is no more than the shift: no settling, no waiting for a search.
TEST(SingleStepGait, BetweenPassingSteps_WeightGoesStraightOn) {
  IdealClimb climb({}, single_step());
  climb.run(60.0);
  const std::vector<LatchedStep> steps = onto_treads(climb);
  ASSERT_EQ(steps.size(), 5U);
  for (std::size_t i = 1; i < steps.size(); ++i) {
    const double stood_s = seconds(steps[i].latch_stamp_ns - steps[i - 1].touch_down_stamp_ns);
    EXPECT_NEAR(stood_s, StepParams{}.durations.stair_shift_ticks * kTick_s, 0.01) << i;
  }
}

TEST(SingleStepGait, NextTreadObstructedOnTheWay_EndsBesideTheFrontFoot) {
  for (const StopReason obstruction :
       {StopReason::kNothingSeen, StopReason::kTop, StopReason::kRiseTooHigh, StopReason::kTreadTooShort,
        StopReason::kTooNarrow, StopReason::kMapStale, StopReason::kEdgeUncertain, StopReason::kDepthMissing,
        StopReason::kDepthNoisy}) {
    IdealClimb climb({}, single_step());
    climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
      if (treads_of(climb).size() < 2) return;
      set.has_p_star = set.has_p_star_star = false;
      set.obstruction = obstruction;
    };
    climb.run(40.0);
    const bool top = obstruction == StopReason::kTop;
    EXPECT_EQ(climb.status().phase, top ? GaitPhase::kFinished : GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, top ? StopReason::kNone : obstruction);
    EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 2, 2})) << static_cast<int>(obstruction);
    EXPECT_EQ(climb.status().treads_climbed, 2U);
    expect_sound(climb);
  }
}

TEST(SingleStepGait, MapLostInSwing_TrailingFootUsesTheMemory) {
  for (const std::size_t swing : {1U, 2U, 3U}) {
    bool blind = false;
    IdealClimb climb({}, single_step());
    climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
      if (blind) set = {};
    };
    run_to_swing(climb, swing);
    blind = true;
    climb.run(20.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, StopReason::kNothingSeen);
    EXPECT_EQ(climb.status().treads_climbed, swing);
    EXPECT_NEAR(climb.true_T_sole(Foot::kLeft).p_m.x(), climb.true_T_sole(Foot::kRight).p_m.x(), 0.004);
    expect_sound(climb);
  }
}

// Lost while the weight is on its way: the foot waits a moment for it to come back, then goes beside the other one.
TEST(SingleStepGait, NextTreadLostInTheShift_GoesOnOrBesideTheFrontFoot) {
  for (const double lost_s : {0.2, 20.0}) {
    IdealClimb climb({}, single_step());
    climb.tamper = [&](StateEstimate& state, FootholdSet& set, JointFeedback&) {
      if (treads_of(climb).size() < 2) return;
      const double since_s = seconds(state.stamp_ns - onto_treads(climb)[1].touch_down_stamp_ns);
      if (since_s > 0.3 && since_s < 0.3 + lost_s) set.obstruction = StopReason::kNothingSeen;
    };
    climb.run(60.0);
    if (lost_s < 1.0) {
      EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 2, 3, 4, 4}));
      EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    } else {
      EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 2, 2}));
      EXPECT_EQ(climb.status().stop_reason, StopReason::kNothingSeen);
    }
    expect_sound(climb);
  }
}

// p** is seen late: what began as a step beside the front foot goes on past it.
TEST(SingleStepGait, NextTreadSeenDuringTheShift_PassesAllTheSame) {
  IdealClimb climb({}, single_step());
  climb.tamper = [&](StateEstimate& state, FootholdSet& set, JointFeedback&) {
    if (treads_of(climb).size() != 2) return;
    const double since_s = seconds(state.stamp_ns - onto_treads(climb)[1].touch_down_stamp_ns);
    if (since_s < 0.3) set.has_p_star = set.has_p_star_star = false;
  };
  climb.run(60.0);
  EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 2, 3, 4, 4}));
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  expect_sound(climb);
}

TEST(SingleStepGait, PassingStepBeyondTheDrives_ClimbsWithBothFeetOnEveryTread) {
  Gait::Params params = single_step();
  params.step.durations.passing_swing_ticks = 250;
  IdealClimb climb({}, params);
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 1, 2, 2, 3, 3, 4, 4}));
  EXPECT_EQ(climb.status().treads_climbed, 4U);
  expect_sound(climb);
}

// The body seems to topple towards the foot in the air, from that tick of the nth swing onto a tread on, for 60 ms.
void topple(IdealClimb& climb, std::size_t nth_onto_tread, int from_tick) {
  climb.tamper = [&climb, nth_onto_tread, from_tick](StateEstimate& state, FootholdSet&, JointFeedback&) {
    if (!in_swing(climb, nth_onto_tread) || climb.status().aborted_swings > 0) return;
    const LatchedStep& step = climb.status().step;
    const auto tick = static_cast<int>((state.stamp_ns - step.latch_stamp_ns) / (2 * kNsPerMs));
    if (tick >= from_tick && tick < from_tick + 30) state.odom_v_base_mps.y() += side_sign(step.foot) * 0.15;
  };
}

TEST(SingleStepGait, PassingFootPutBack_PassesAgain) {
  for (const std::size_t swing : {2U, 3U}) {
    IdealClimb climb({}, single_step());
    topple(climb, swing, 10);
    climb.run(60.0);
    EXPECT_EQ(climb.status().aborted_swings, 1U);
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << static_cast<int>(climb.status().stop_reason);
    EXPECT_EQ(climb.status().treads_climbed, 4U);
    EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 2, 3, 4, 4})) << swing;
  }
}

// It lands as far out as it may: from there a shift of the weight asks more of the ankle than the plan of a step up
// takes, by a milliradian. A sole that rolls in the air would need no closing.
TEST(SingleStepGait, ToppledOnTheWay_LandsBesideTheFrontFootClosesUpAndClimbsOn) {
  Gait::Params params = single_step();
  params.step.stair_swing.air_roll_rad = params.step.passing_swing.air_roll_rad = 0.0;
  params.swing.timing.widen_m = 0.06;
  IdealClimb climb({}, params);
  topple(climb, 3, 70);
  run_to_swing(climb, 3);
  EXPECT_TRUE(climb.status().step.height_mapped);
  climb.run(60.0);
  EXPECT_EQ(climb.status().aborted_swings, 0U);
  const LatchedStep beside = onto_treads(climb)[2];
  EXPECT_FALSE(beside.height_mapped);
  const Vec3 apart_m = beside.odom_T_target.p_m - onto_treads(climb)[1].odom_T_executed.p_m;
  EXPECT_NEAR(apart_m.x(), 0.0, 0.01);
  EXPECT_NEAR(std::abs(apart_m.y()), 2.0 * kStanceHalfWidth_m, 0.01);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << static_cast<int>(climb.status().stop_reason);
  EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 2, 2, 2, 3, 4, 4}));
  const LatchedStep closing = onto_treads(climb)[3];
  EXPECT_EQ(closing.foot, beside.foot);
  EXPECT_FALSE(closing.height_mapped);
  EXPECT_NEAR(std::abs((closing.odom_T_executed.p_m - onto_treads(climb)[1].odom_T_executed.p_m).y()),
              2.0 * kStanceHalfWidth_m, 0.01);
  EXPECT_GE(climb.record().joint_margin_rad, 0.0);
}

// The stance that a step cannot be made from is not too wide: there is nothing to close.
TEST(SingleStepGait, LegsCannotFromAStanceOfUsualWidth_StopsWithoutClosingUp) {
  IdealClimb climb({}, single_step());
  climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
    if (treads_of(climb).empty()) return;
    for (auto* feet : {&set.p_star_feet, &set.p_star_star_feet}) {
      for (Foothold& hold : *feet) hold.position_m.z() += 0.3;
    }
  };
  climb.run(60.0);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_EQ(treads_of(climb), (std::vector<int>{1, 1}));
}

TEST(SingleStepGait, StateLostWhileThePassingStepIsImpossible_StopsOnBothFeet) {
  IdealClimb climb({}, single_step());
  std::int64_t lost_ns = 0;
  climb.tamper = [&](StateEstimate& state, FootholdSet& set, JointFeedback&) {
    if (treads_of(climb).size() != 1 || climb.status().phase == GaitPhase::kSwing) return;
    for (auto* feet : {&set.p_star_feet, &set.p_star_star_feet}) {
      for (Foothold& hold : *feet) hold.position_m.z() += 0.3;
    }
    if (lost_ns == 0) lost_ns = state.stamp_ns + 10 * kNsPerMs;  // the shift has begun
    state.oldest_input_ns = std::min(state.oldest_input_ns, lost_ns);
  };
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kStateStale);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
}

TEST(SingleStepGait, StopRequestedInEveryPhase_EndsOnBothFeet) {
  for (const std::size_t swing : {1U, 2U, 3U, 5U}) {
    for (const int after_ticks : {0, 250, 560}) {
      IdealClimb climb({}, single_step());
      run_to_swing(climb, swing);
      for (int i = 0; i < after_ticks; ++i) climb.tick();
      const std::uint32_t committed = climb.status().step.sequence;
      climb.gait().request_stop(StopReason::kOperator);
      climb.run(20.0);
      EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
      EXPECT_EQ(climb.status().stop_reason, StopReason::kOperator);
      EXPECT_EQ(climb.status().step.sequence, committed);
      for (int i = 0; i < 500; ++i) climb.tick();
      EXPECT_TRUE(climb.touches(Foot::kLeft) && climb.touches(Foot::kRight));
      expect_sound(climb);
    }
  }
}

}  // namespace
}  // namespace polygmap
