// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "tests/support/ideal_climb.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

using test::ClimbRecord;
using test::ClimbSetup;
using test::IdealClimb;

void expect_sound_commands(const IdealClimb& climb) {
  const ClimbRecord& r = climb.record();
  EXPECT_LE(*std::max_element(r.speed_share.begin(), r.speed_share.end()), 1.0 + 1e-9);
  EXPECT_GE(r.joint_margin_rad, 0.0);
  EXPECT_GE(r.knee_min_rad, 0.05);
}

void expect_climbed(const IdealClimb& climb, const ClimbSetup& setup) {
  const ClimbRecord& r = climb.record();
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << static_cast<int>(climb.status().stop_reason);
  EXPECT_EQ(climb.status().treads_climbed, static_cast<std::uint32_t>(setup.stairs.steps));
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  expect_sound_commands(climb);
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
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kNothingSeen);
  EXPECT_EQ(climb.status().treads_climbed, 1U);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
  EXPECT_NEAR(climb.true_T_sole(Foot::kLeft).p_m.x(), climb.true_T_sole(Foot::kRight).p_m.x(), 0.003);
  EXPECT_LT(climb.record().execution_m, 0.003);
}

TEST(GaitStop, ReasonsOfTheSearch_StopBeforeTheStairsWithTheMeasure) {
  ClimbSetup high;
  high.stairs.rise_m = 0.5;
  IdealClimb a(high);
  a.run(20.0);
  EXPECT_EQ(a.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(a.status().stop_reason, Obstruction::kRiseTooHigh);
  EXPECT_DOUBLE_EQ(a.status().stop_measured_m, 0.5);
  EXPECT_EQ(a.status().step.sequence, 0U);

  ClimbSetup shallow;
  shallow.stairs.tread_m = 0.1;
  IdealClimb b(shallow);
  b.run(20.0);
  EXPECT_EQ(b.status().stop_reason, Obstruction::kTreadTooShort);
  EXPECT_DOUBLE_EQ(b.status().stop_measured_m, 0.1);
}

TEST(GaitStop, EveryObstructionAfterTheFirstTread_StandsOnBothFeet) {
  for (const Obstruction obstruction :
       {Obstruction::kNothingSeen, Obstruction::kNoStaircase, Obstruction::kTop, Obstruction::kRiseTooHigh,
        Obstruction::kTreadTooShort, Obstruction::kTooNarrow, Obstruction::kMapStale, Obstruction::kEdgeUncertain}) {
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
    const bool top = obstruction == Obstruction::kTop || obstruction == Obstruction::kNoStaircase;
    EXPECT_EQ(status.phase, top ? GaitPhase::kFinished : GaitPhase::kStopped);
    EXPECT_EQ(status.stop_reason, top ? Obstruction::kNone : obstruction);
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
    if (climb.status().treads_climbed == 2 && since_ns < 800 * kNsPerMs) set.obstruction = Obstruction::kMapStale;
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
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kMapStale);
  EXPECT_EQ(climb.status().treads_climbed, 2U);
}

TEST(GaitStop, NothingSeenAtTheStart_WaitsThenStopsWithoutAStep) {
  IdealClimb climb({});
  climb.tamper = [](StateEstimate&, FootholdSet& set, JointFeedback&) { set = {}; };
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kNothingSeen);
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
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kLegsCannot);
  EXPECT_NEAR(climb.status().stop_measured_m, 0.33, 0.003);
  EXPECT_EQ(climb.status().treads_climbed, 0U);
  EXPECT_FALSE(climb.status().step.onto_tread);
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
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kLegsCannot);
  EXPECT_EQ(climb.status().stop_measured_m, 0.0);
  EXPECT_TRUE(climb.status().step.onto_tread);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
}

TEST(GaitStop, FloorStepBeyondTheDrives_BlamesNoRise) {
  Gait::Params params;
  params.step.floor_swing_ticks = 20;
  IdealClimb climb({}, params);
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kLegsCannot);
  EXPECT_EQ(climb.status().stop_measured_m, 0.0);
  EXPECT_EQ(climb.status().step.sequence, 0U);
}

constexpr std::uint32_t kOnTheFirstTread = 1;
// Calls disturb(ns since both feet stood on the first tread, footholds).
void disturb_after_the_first_tread(IdealClimb& climb,
                                   const std::function<void(std::int64_t since_ns, FootholdSet& set)>& disturb) {
  climb.tamper = [&climb, disturb](StateEstimate& state, FootholdSet& set, JointFeedback&) {
    if (climb.status().treads_climbed < kOnTheFirstTread) return;
    disturb(state.stamp_ns - climb.status().step.touch_down_stamp_ns, set);
  };
}
void expect_unsteady(IdealClimb& climb) {
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kUnsteady);
  EXPECT_EQ(climb.status().treads_climbed, kOnTheFirstTread);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
  expect_sound_commands(climb);
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
    if (since_ns % kNsPerS > 100 * kNsPerMs) set.obstruction = Obstruction::kNothingSeen;
  });
  expect_unsteady(climb);
}

TEST(GaitStop, ReasonsThatComeAndGo_AreCalledUnsteady) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    set.obstruction = since_ns / (300 * kNsPerMs) % 2 == 0 ? Obstruction::kTop : Obstruction::kNothingSeen;
  });
  expect_unsteady(climb);
}

TEST(GaitFinish, TopSeenAfterAnotherObstruction_WaitsAWholeSecondOfTop) {
  IdealClimb climb({});
  disturb_after_the_first_tread(climb, [](std::int64_t since_ns, FootholdSet& set) {
    set.obstruction = since_ns < 800 * kNsPerMs ? Obstruction::kNothingSeen : Obstruction::kTop;
  });
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  const double waited_s = seconds(climb.status().stamp_ns - climb.status().step.touch_down_stamp_ns);
  EXPECT_GT(waited_s, 1.79);
  EXPECT_LT(waited_s, 1.9);
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
  EXPECT_GT(seconds(climb.status().step.latch_stamp_ns - stood_ns), 2 * 0.62);
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  expect_sound_commands(climb);
}

// The nth swing onto a tread finds nothing: 1 is a leading foot, 2 a trailing one.
bool in_swing_onto_tread(const IdealClimb& climb, int nth) {
  const auto& done = climb.record().steps;
  const auto landed = std::count_if(done.begin(), done.end(), [](const LatchedStep& step) { return step.onto_tread; });
  return climb.status().phase == GaitPhase::kSwing && climb.status().step.onto_tread && landed + 1 == nth;
}
void expect_put_back(IdealClimb& climb, int nth) {
  while (climb.tick() && !in_swing_onto_tread(climb, nth)) {
  }
  const Foot foot = climb.status().step.foot;
  const Transform stood = climb.true_T_sole(foot);  // the tick of the lift-off
  climb.run(40.0);
  const GaitStatus& status = climb.status();
  EXPECT_EQ(status.phase, GaitPhase::kStopped);
  EXPECT_EQ(status.stop_reason, Obstruction::kGroundMissing);
  EXPECT_EQ(status.stop_measured_m, 0.0);
  EXPECT_TRUE(status.stands[0] && status.stands[1]);
  EXPECT_EQ(status.late_contacts, 1U);
  EXPECT_EQ(status.put_back, 1U);
  EXPECT_EQ(status.treads_climbed, 0U);
  EXPECT_EQ(status.step.touch_down_stamp_ns, 0);
  for (int i = 0; i < 500; ++i) climb.tick();
  EXPECT_TRUE(climb.touches(Foot::kLeft) && climb.touches(Foot::kRight));
  EXPECT_LT((climb.true_T_sole(foot).p_m - stood.p_m).norm(), 0.003);
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  EXPECT_LT(climb.record().penetration_m, 0.002);
  expect_sound_commands(climb);
}

TEST(GaitContact, TreadFarLowerThanMapped_PutsTheFootBackAndSaysSo) {
  ClimbSetup setup;
  setup.stairs.rise_m = 0.10;
  setup.map_shift_z_m = 0.07;
  IdealClimb climb(setup);
  expect_put_back(climb, 1);
}

TEST(GaitReach, EstimateJumpsInMidSwing_LegStopsAtItsReachAndIsCounted) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback&) {
    if (climb.status().phase == GaitPhase::kSwing) state.odom_T_base.p_m.x() += 1.0;
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 1));
  for (int i = 0; i < 300; ++i) climb.tick();
  EXPECT_GT(climb.status().ik_limited_ticks, 0U);
  EXPECT_LE(*std::max_element(climb.record().speed_share.begin(), climb.record().speed_share.end()), 1.0 + 1e-9);
  EXPECT_GE(climb.record().joint_margin_rad, 0.0);
}

TEST(GaitContact, ForceSensorStuckOn_LandsByThePlan) {
  IdealClimb climb({});
  climb.tamper = [](StateEstimate&, FootholdSet&, JointFeedback& feedback) { feedback.foot_force_n = {300.0, 300.0}; };
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 4U);
}

TEST(GaitContact, BumpInTheAir_HoldsTheReferenceWithoutAJump) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    const LatchedStep& step = climb.status().step;
    if (climb.status().phase == GaitPhase::kSwing && step.sequence == 2 &&
        state.stamp_ns - step.latch_stamp_ns > 540 * kNsPerMs) {
      feedback.foot_force_n[index_of(step.foot)] = 100.0;  // 30 mm above the floor, in the fastest part of the landing
    }
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  EXPECT_EQ(climb.status().early_contacts, 1U);
  const std::size_t i = index_of(climb.status().step.foot);
  const auto relative = [&] {
    const auto& soles = climb.status().odom_T_sole_desired;
    return Vec3((soles[1 - i].inverse() * soles[i]).p_m);
  };
  const Vec3 held = relative();
  for (int n = 0; n < 100; ++n) {
    climb.tick();
    EXPECT_LT((relative() - held).norm(), 1e-4);
  }
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  expect_sound_commands(climb);
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
    climb.gait().request_stop();
    climb.run(20.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, Obstruction::kNone);
    EXPECT_EQ(climb.status().step.sequence, when.last_swing);
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
    for (int i = 0; i < 500; ++i) climb.tick();  // it goes on holding, and settles
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_TRUE(climb.touches(Foot::kLeft) && climb.touches(Foot::kRight));
    expect_sound_commands(climb);
  }
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

TEST(GaitInput, NotInitialised_HoldsTheMeasuredJointsAndNeverMoves) {
  Gait gait;
  gait.reset({});
  JointFeedback feedback;
  for (int i = 0; i < 12; ++i) feedback.q_rad[i] = 0.01 * i;
  JointCommand command;
  for (int i = 0; i < 2000; ++i) {
    gait.tick(0, {}, {}, feedback, command);
    feedback.q_rad.array() += 1e-4;  // it must not follow a sagging joint
  }
  EXPECT_EQ(gait.status().phase, GaitPhase::kStandstill);
  for (std::size_t i = 0; i < kJointCount; ++i) {
    EXPECT_DOUBLE_EQ(command.joints[i].q_rad, 0.01 * static_cast<double>(i));
    EXPECT_EQ(command.joints[i].dq_radps, 0.0);
    EXPECT_GT(command.joints[i].kp_nmprad, 0.0);
  }
}

TEST(GaitInput, NoGoodReading_DrivesGetNoStiffness) {
  for (const double knee_rad : {std::numeric_limits<double>::quiet_NaN(), -0.1, 2.7, 1e9}) {
    Gait gait;
    gait.reset({});
    JointFeedback feedback;
    feedback.q_rad[kKnee] = knee_rad;
    JointCommand command;
    gait.tick(0, {}, {}, feedback, command);
    for (const JointSetpoint& joint : command.joints) EXPECT_EQ(joint.kp_nmprad, 0.0) << knee_rad;
    feedback.q_rad[kKnee] = 0.5;
    gait.tick(0, {}, {}, feedback, command);
    EXPECT_GT(command.joints[kKnee].kp_nmprad, 0.0) << knee_rad;
    EXPECT_DOUBLE_EQ(command.joints[kKnee].q_rad, 0.5);
  }
}

TEST(GaitInput, EncoderALittleOutsideTheRange_HoldsAtTheLimit) {
  Gait gait;
  gait.reset({});
  JointFeedback feedback;
  feedback.q_rad[kKnee] = -0.01;
  JointCommand command;
  gait.tick(0, {}, {}, feedback, command);
  EXPECT_GT(command.joints[kKnee].kp_nmprad, 0.0);
  EXPECT_EQ(command.joints[kKnee].q_rad, 0.0);
}

class JointReferenceTest : public testing::Test {
 protected:
  JointReferenceTest() {
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      base_T_sole_[index_of(leg)] = {Mat3::Identity(), Vec3{0, side_sign(leg) * kStanceHalfWidth_m, -0.75}};
      q_rad_.segment<6>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
          solve_leg({}, leg, base_T_sole_[index_of(leg)]).q_rad;
    }
    EXPECT_TRUE(reference_.try_arm({}, {}, q_rad_));
  }
  JointReference reference_;
  JointVector q_rad_;
  std::array<Transform, kFootCount> base_T_sole_;
  JointCommand command_;
};

TEST_F(JointReferenceTest, PoseReached_IsNotLimited) {
  EXPECT_FALSE(reference_.follow(base_T_sole_, {true, true}, command_));
  for (std::size_t n = 0; n < kJointCount; ++n) {
    EXPECT_NEAR(command_.joints[n].q_rad, q_rad_[static_cast<Eigen::Index>(n)], 1e-9);
  }
}

TEST_F(JointReferenceTest, PoseNotFinite_LegStaysWhereItIs) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      auto soles = base_T_sole_;
      soles[0].p_m[axis] = bad;
      for (int i = 0; i < 100; ++i) EXPECT_TRUE(reference_.follow(soles, {true, true}, command_));
      for (std::size_t n = 0; n < kJointCount; ++n) {
        EXPECT_NEAR(command_.joints[n].q_rad, q_rad_[static_cast<Eigen::Index>(n)], 1e-9) << n;
        EXPECT_NEAR(command_.joints[n].dq_radps, 0.0, 1e-9) << n;
      }
    }
  }
}

TEST_F(JointReferenceTest, PoseOutOfReach_IsLimited) {
  base_T_sole_[1].p_m.z() = -1.2;
  EXPECT_TRUE(reference_.follow(base_T_sole_, {true, true}, command_));
}

TEST(GaitInput, NanInEstimatesAndFootholds_NeverReachesACommand) {
  IdealClimb climb({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  climb.tamper = [&](StateEstimate& state, FootholdSet& set, JointFeedback& feedback) {
    const std::int64_t n = state.stamp_ns / (2 * kNsPerMs);
    if (n % 7 == 3) state.odom_T_base.p_m.x() = nan;
    if (n % 11 == 5) state.world_T_odom.R(0, 0) = nan;
    if (n % 64 < 16) set.p_star_feet[0].position_m.y() = nan;
    if (n % 64 >= 32 && n % 64 < 48) set.tread.nosing_a_m.x() = nan;
    if (n % 13 == 5) feedback.foot_force_n = {nan, nan};
  };
  climb.run(90.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_TRUE(math::all_finite(climb.true_T_base().p_m));
  expect_sound_commands(climb);
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

}  // namespace
}  // namespace polygmap
