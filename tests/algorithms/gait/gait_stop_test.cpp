// SPDX-License-Identifier: Apache-2.0
// How a climb ends: by itself, for a reason, when asked to.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/support/gait_checks.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

using test::ClimbSetup;
using test::disturb_after_the_first_tread;
using test::IdealClimb;
using test::kOnTheFirstTread;

TEST(GaitStop, ReasonsOfTheSearch_StopBeforeTheStairsWithTheMeasure) {
  ClimbSetup high;
  high.stairs.rise_m = 0.5;
  IdealClimb a(high);
  a.run(20.0);
  EXPECT_EQ(a.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(a.status().stop_reason, StopReason::kRiseTooHigh);
  EXPECT_DOUBLE_EQ(a.status().stop_measured_m, 0.5);
  EXPECT_EQ(a.status().step.sequence, 0U);

  ClimbSetup shallow;
  shallow.stairs.tread_m = 0.1;
  IdealClimb b(shallow);
  b.run(20.0);
  EXPECT_EQ(b.status().stop_reason, StopReason::kTreadTooShort);
  EXPECT_DOUBLE_EQ(b.status().stop_measured_m, 0.1);
}

// Whoever reads the status afterwards takes a stop without a reason for the gait's own.
TEST(GaitStop, AskedToStopAfterTheClimbsEnd_SaysWhoAsked) {
  IdealClimb climb({});
  climb.run(60.0);
  ASSERT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kNone);
  climb.gait().request_stop(StopReason::kOperator);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kOperator);
  climb.gait().request_stop(StopReason::kTimeShort);
  (void)climb.tick();
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kOperator) << "the first to ask";
  ASSERT_TRUE(climb.gait().try_restart(climb.q_rad()));
  EXPECT_EQ(climb.status().stop_reason, StopReason::kNone);
}

TEST(GaitStop, EveryObstructionAfterTheFirstTread_StandsOnBothFeet) {
  for (const StopReason obstruction :
       {StopReason::kNothingSeen, StopReason::kNoStaircase, StopReason::kTop, StopReason::kRiseTooHigh,
        StopReason::kTreadTooShort, StopReason::kTooNarrow, StopReason::kMapStale, StopReason::kEdgeUncertain,
        StopReason::kDepthMissing, StopReason::kDepthNoisy}) {
    IdealClimb climb({});
    climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
      if (climb.status().treads_climbed == 0) return;
      set.has_p_star = false;
      set.obstruction = obstruction;
      set.measured_rise_m = 0.3;
      set.measured_tread_m = 0.2;
    };
    climb.run(40.0);
    const GaitStatus& status = climb.status();
    const bool top = obstruction == StopReason::kTop || obstruction == StopReason::kNoStaircase;
    EXPECT_EQ(status.phase, top ? GaitPhase::kFinished : GaitPhase::kStopped);
    EXPECT_EQ(status.stop_reason, top ? StopReason::kNone : obstruction);
    EXPECT_TRUE(status.stands[0] && status.stands[1]);
    EXPECT_EQ(status.treads_climbed, 1U);
    const double waited_s = seconds(status.stamp_ns - status.step.touch_down_stamp_ns);
    EXPECT_GT(waited_s, 0.99);
    EXPECT_LT(waited_s, 1.1);
  }
}

TEST(GaitStop, ObstructionForAMoment_GoesOn) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate& state, FootholdSet& set, JointFeedback&) {
    const std::int64_t since_ns = state.stamp_ns - climb.status().step.touch_down_stamp_ns;
    if (climb.status().treads_climbed == 2 && since_ns < 800 * kNsPerMs) set.obstruction = StopReason::kMapStale;
  };
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 4U);
}

TEST(GaitStop, SearchNoLongerRuns_StopsForAStaleMap) {
  IdealClimb climb({});
  FootholdSet last;
  climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
    if (climb.status().treads_climbed < 2) {
      last = set;
    } else {
      set = last;
      set.map_stamp_ns -= 400 * kNsPerMs;  // too old before the next foot could lift
    }
  };
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kMapStale);
  EXPECT_EQ(climb.status().treads_climbed, 2U);
}

TEST(GaitStop, NothingSeenAtTheStart_WaitsThenStopsWithoutAStep) {
  IdealClimb climb({});
  climb.tamper = [](StateEstimate&, FootholdSet& set, JointFeedback&) { set = {}; };
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kNothingSeen);
  EXPECT_EQ(climb.status().step.sequence, 0U);
  EXPECT_GT(seconds(climb.record().end_ns), 3.0);
  EXPECT_LT(seconds(climb.record().end_ns), 4.5);
}

// The search offers a step that only the legs know to be too high.
TEST(GaitStop, LeadingStepBeyondTheLegs_StopsBeforeTheStairsWithTheRise) {
  IdealClimb climb({});
  climb.tamper = [](StateEstimate&, FootholdSet& set, JointFeedback&) {
    for (Foothold& hold : set.p_star_feet) hold.position_m.z() += 0.2;
  };
  climb.run(40.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_NEAR(climb.status().stop_measured_m, 0.33, 0.003);
  EXPECT_EQ(climb.status().treads_climbed, 0U);
  EXPECT_FALSE(climb.status().step.onto_tread);
}

// As from a body that a push still moves: from rest the same step is one for the legs.
TEST(GaitStop, LegsCannotTwice_TriesOnceMoreAndClimbs) {
  const auto refused_until = [](IdealClimb& climb, std::int64_t until_ns) {
    climb.tamper = [&climb, until_ns](StateEstimate& state, FootholdSet& set, JointFeedback&) {
      if (climb.status().treads_climbed != 1 || state.stamp_ns >= until_ns) return;
      for (Foothold& hold : set.p_star_feet) hold.position_m.z() += 0.2;
    };
    climb.run(60.0);
  };
  Gait::Params twice;
  twice.weight_shift.max_refusals = 2;
  IdealClimb stopped({}, twice), climbed({});
  refused_until(stopped, 60 * kNsPerS);
  ASSERT_EQ(stopped.status().stop_reason, StopReason::kLegsCannot);
  refused_until(climbed, stopped.record().end_ns);
  EXPECT_EQ(climbed.status().phase, GaitPhase::kFinished);
}

TEST(GaitStop, TrailingStepBeyondTheLegs_BlamesNoRise) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
    const LatchedStep& step = climb.status().step;
    if (!step.onto_tread || step.touch_down_stamp_ns == 0) return;
    Foothold& hold = set.p_star_feet[index_of(other(step.foot))];
    hold = step.target;
    hold.position_m.z() += 0.3;
    set.has_p_star = true;
  };
  climb.run(40.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_EQ(climb.status().stop_measured_m, 0.0);
  EXPECT_TRUE(climb.status().step.onto_tread);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
}

TEST(GaitStop, FloorStepBeyondTheDrives_BlamesNoRise) {
  Gait::Params params;
  params.step.durations.floor_swing_ticks = 20;
  IdealClimb climb({}, params);
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_EQ(climb.status().stop_measured_m, 0.0);
  EXPECT_EQ(climb.status().step.sequence, 0U);
}

void expect_unsteady(IdealClimb& climb) {
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kUnsteady);
  EXPECT_EQ(climb.status().treads_climbed, kOnTheFirstTread);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
  test::expect_sound_commands(climb);
}

TEST(GaitStop, TargetsThatNeverHoldStill_AreCalledUnsteady) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    const double off_m = since_ns / (250 * kNsPerMs) % 2 == 0 ? 0.02 : -0.02;
    for (Foothold& hold : set.p_star_feet) hold.position_m += rotation_z(hold.yaw_rad) * Vec3{off_m, 0, 0};
  });
  expect_unsteady(climb);
}

TEST(GaitStop, FootholdsThatComeAndGo_AreCalledUnsteady) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    if (since_ns % kNsPerS > 100 * kNsPerMs) set.obstruction = StopReason::kNothingSeen;
  });
  expect_unsteady(climb);
}

TEST(GaitStop, FootholdsThatComeAndGoInNoisyPictures_BlameTheNoise) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    if (since_ns % kNsPerS > 100 * kNsPerMs) set.obstruction = StopReason::kNothingSeen;
    set.unsteady = StopReason::kDepthNoisy;
  });
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kDepthNoisy);
}

TEST(GaitStop, ReasonsThatComeAndGo_AreCalledUnsteady) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    set.obstruction = since_ns / (300 * kNsPerMs) % 2 == 0 ? StopReason::kTop : StopReason::kNothingSeen;
  });
  expect_unsteady(climb);
}

TEST(GaitStop, EdgeKnownTooVaguelyFromAfar_WalksUpAndLooksAgain) {
  for (const bool better_from_nearby : {true, false}) {
    IdealClimb climb({});
    climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
      const double gap_m = -climb.true_T_sole(Foot::kLeft).p_m.x() - kCollisionRectangle.toe_x_m;
      if (climb.status().treads_climbed > 0 || (better_from_nearby && gap_m < 0.1)) return;
      set.obstruction = StopReason::kEdgeUncertain;
      set.has_p_star = false;
    };
    climb.run(60.0);
    EXPECT_GT(climb.status().step.sequence, 1U);
    EXPECT_EQ(climb.status().phase, better_from_nearby ? GaitPhase::kFinished : GaitPhase::kStopped);
    if (better_from_nearby) continue;
    EXPECT_EQ(climb.status().stop_reason, StopReason::kEdgeUncertain);
    EXPECT_FALSE(climb.status().step.onto_tread);
  }
}

// Under physics a foot slid 12 mm after every step: it lined up for as long as the run lasted.
TEST(GaitStop, NeverLinedUpBeforeTheStairs_SaysSo) {
  struct Case {
    double off_m;
    std::uint32_t least_steps, most_steps;
  };
  for (const Case& one : {Case{0.04, 9, 19}, Case{0.1, 60, 61}}) {
    IdealClimb climb({});
    climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
      const double x_m = climb.status().step.sequence / 2 % 2 == 0 ? 0.0 : -one.off_m;
      const Vec3 shift_m = rotation_z(set.p_star_feet[0].yaw_rad) * Vec3{x_m, 0, 0};
      for (Vec3* p : {&set.p_star_feet[0].position_m, &set.p_star_feet[1].position_m, &set.tread.nosing_a_m,
                      &set.tread.nosing_b_m}) {
        *p += shift_m;
      }
    };
    climb.run(180.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, StopReason::kNotLinedUp);
    EXPECT_FALSE(climb.status().step.onto_tread);
    EXPECT_GE(climb.status().step.sequence, one.least_steps);
    EXPECT_LE(climb.status().step.sequence, one.most_steps);
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
  }
}

// The body seems to topple towards every foot that lifts.
TEST(GaitStop, EveryFootGoesBack_StopsAfterSomeAndSaysSo) {
  for (const bool at_last_it_stands : {false, true}) {
    IdealClimb climb({});
    const std::uint32_t most = Gait::Params{}.swing.max_aborted;
    climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback&) {
      const LatchedStep& step = climb.status().step;
      if (climb.status().phase != GaitPhase::kSwing || !step.onto_tread) return;
      // The last one before it would stop lands; a tread on, one more goes back.
      if (at_last_it_stands && climb.status().aborted_swings >= most) return;
      if (at_last_it_stands && climb.status().aborted_swings + 1 == most && climb.status().treads_climbed == 0) return;
      const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns;
      if (since_ns > 20 * kNsPerMs && since_ns < 80 * kNsPerMs) {
        state.odom_v_base_mps.y() += side_sign(step.foot) * 0.15;
      }
    };
    climb.run(60.0);
    EXPECT_EQ(climb.status().aborted_swings, most);
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
    if (at_last_it_stands) {
      EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
      continue;
    }
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, StopReason::kToppling);
    EXPECT_EQ(climb.status().treads_climbed, 0U);
  }
}

// Stopped with the weight all but over the front foot, where the rear leg allows less height than in the middle.
TEST(GaitStop, BetweenTwoLevels_RisesAsFarAsTheLegsReachOnceSettled) {
  IdealClimb climb({});
  while (!climb.status().step.onto_tread || climb.status().phase == GaitPhase::kSwing) ASSERT_TRUE(climb.tick());
  for (int i = 0; i < 155; ++i) ASSERT_TRUE(climb.tick());
  ASSERT_EQ(climb.status().phase, GaitPhase::kDoubleSupport);
  climb.gait().request_stop(StopReason::kOperator);
  climb.run(5.0);
  ASSERT_EQ(climb.status().phase, GaitPhase::kStopped);
  for (int i = 0; i < 1000; ++i) climb.tick();
  const SolePair soles{sole_pose(climb.true_T_sole(Foot::kLeft)), sole_pose(climb.true_T_sole(Foot::kRight))};
  ASSERT_GT(std::abs(soles[0].position_m.z() - soles[1].position_m.z()), 0.1);
  const Gait::Params params;
  const double height_m = torso_between(nominal_robot().legs, params.step.torso, soles).position_m.z();
  EXPECT_NEAR(climb.true_T_base().p_m.z(), height_m, 0.005);
}

TEST(GaitFinish, TopSeenAfterAnotherObstruction_WaitsAWholeSecondOfTop) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    set.obstruction = since_ns < 800 * kNsPerMs ? StopReason::kNothingSeen : StopReason::kTop;
  });
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  const double waited_s = seconds(climb.status().stamp_ns - climb.status().step.touch_down_stamp_ns);
  EXPECT_GT(waited_s, 1.79);
  EXPECT_LT(waited_s, 1.9);
}

TEST(GaitRequestStop, InEveryPhase_EndsOnBothFeet) {
  struct When {
    GaitPhase phase;
    std::uint32_t swing;
    std::uint32_t last_swing;
  };
  for (const When& when :
       {When{GaitPhase::kStandstill, 0, 0}, When{GaitPhase::kDoubleSupport, 0, 0}, When{GaitPhase::kSwing, 1, 1},
        When{GaitPhase::kDoubleSupport, 2, 2}, When{GaitPhase::kSwing, 5, 5}, When{GaitPhase::kSwing, 6, 6}}) {
    IdealClimb climb({});
    ASSERT_TRUE(climb.run_until(when.phase, when.swing));
    for (int i = 0; i < 40; ++i) climb.tick();
    climb.gait().request_stop(StopReason::kOperator);
    climb.run(20.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, StopReason::kOperator);
    EXPECT_EQ(climb.status().step.sequence, when.last_swing);
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
    for (int i = 0; i < 500; ++i) climb.tick();  // it goes on holding, and settles
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_TRUE(climb.touches(Foot::kLeft) && climb.touches(Foot::kRight));
    test::expect_sound_commands(climb);
  }
}

// Of swings as long as the longest that are tried. Each moment is a climb of its own, stopped: a slow machine tries
// fewer.
TEST(GaitRequestStop, AtEveryMomentOfASwing_BothFeetStandWithinASecond) {
  constexpr int kWithin_ticks = 500, kApart_ticks = test::kSlowMachine ? 41 : 3;
  constexpr double kLongest = 1.15;
  for (const StepTries tries : {StepTries(kStepTries), StepTries(kPassingTries)}) {
    for (const StepTry& tried : tries) ASSERT_LE(tried.longer, kLongest);
  }
  for (const GaitPattern pattern : {GaitPattern::kDoubleStep, GaitPattern::kSingleStep}) {
    Gait::Params params;
    params.planner.pattern = pattern;
    StepDurations& durations = params.step.durations;
    for (std::int32_t* ticks :
         {&durations.stair_swing_ticks, &durations.passing_swing_ticks, &durations.floor_swing_ticks}) {
      *ticks = static_cast<std::int32_t>(kLongest * *ticks);
    }
    IdealClimb climb({}, params);
    int longest_ticks = 0, swing_ticks = 0;
    while (climb.tick()) {
      swing_ticks = climb.status().phase == GaitPhase::kSwing ? swing_ticks + 1 : 0;
      longest_ticks = std::max(longest_ticks, swing_ticks);
      if (swing_ticks % kApart_ticks != 1) continue;
      SCOPED_TRACE("tick " + std::to_string(swing_ticks) + " of swing " + std::to_string(climb.status().step.sequence));
      IdealClimb stopped = climb;
      stopped.gait().request_stop(StopReason::kOperator);
      int ticks = 0;
      do {
        stopped.tick();
      } while (++ticks < 2 * kWithin_ticks && !(stopped.status().stands[0] && stopped.status().stands[1]));
      EXPECT_LE(ticks, kWithin_ticks);
      stopped.run(5.0);
      EXPECT_EQ(stopped.status().phase, GaitPhase::kStopped);
      EXPECT_EQ(stopped.status().stop_reason, StopReason::kOperator);
      for (int i = 0; i < 500; ++i) stopped.tick();  // it settles
      EXPECT_TRUE(stopped.touches(Foot::kLeft) && stopped.touches(Foot::kRight));
      test::expect_sound_commands(stopped);
    }
    EXPECT_GT(longest_ticks, kWithin_ticks);
  }
}

}  // namespace
}  // namespace polygmap
