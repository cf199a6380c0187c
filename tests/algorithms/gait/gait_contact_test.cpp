// SPDX-License-Identifier: Apache-2.0
// Ground that comes early, late or not at all, and legs that do not reach.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/gait_checks.hpp"

namespace polygmap {
namespace {

using test::ClimbSetup;
using test::IdealClimb;

// The nth swing onto a tread finds nothing: 1 is a leading foot, 2 a trailing one.
bool in_swing_onto_tread(const IdealClimb& climb, int nth) {
  const auto& done = climb.record().steps;
  const auto landed = std::count_if(done.begin(), done.end(), [](const LatchedStep& step) { return step.onto_tread; });
  return climb.status().phase == GaitPhase::kSwing && climb.status().step.onto_tread && landed + 1 == nth;
}

void expect_swing_aborted(IdealClimb& climb, int nth) {
  while (climb.tick() && !in_swing_onto_tread(climb, nth)) {
  }
  const Foot foot = climb.status().step.foot;
  const Transform stood = climb.true_T_sole(foot);  // the tick of the lift-off
  climb.run(40.0);
  const GaitStatus& status = climb.status();
  EXPECT_EQ(status.phase, GaitPhase::kStopped);
  EXPECT_EQ(status.stop_reason, StopReason::kGroundMissing);
  EXPECT_EQ(status.stop_measured_m, 0.0);
  EXPECT_TRUE(status.stands[0] && status.stands[1]);
  EXPECT_EQ(status.late_contacts, 1U);
  EXPECT_EQ(status.aborted_swings, 1U);
  EXPECT_EQ(status.treads_climbed, 0U);
  EXPECT_EQ(status.step.touch_down_stamp_ns, 0);
  for (int i = 0; i < 500; ++i) climb.tick();
  EXPECT_TRUE(climb.touches(Foot::kLeft) && climb.touches(Foot::kRight));
  EXPECT_LT((climb.true_T_sole(foot).p_m - stood.p_m).norm(), 0.003);
  EXPECT_EQ(climb.status().ik_limited_ticks, 0U);
  EXPECT_LT(climb.record().penetration_m, 0.002);
  test::expect_sound_commands(climb);
}

TEST(GaitContact, TreadFarLowerThanMapped_PutsTheFootBackAndSaysSo) {
  ClimbSetup setup;
  setup.stairs.rise_m = 0.10;
  setup.map_shift_z_m = 0.07;
  IdealClimb climb(setup);
  expect_swing_aborted(climb, 1);
}

TEST(GaitContact, ForceSensorStuckOn_LandsByThePlan) {
  IdealClimb climb({});
  climb.tamper = [](StateEstimate&, FootholdSet&, JointFeedback& feedback) { feedback.foot_force_n = {300.0, 300.0}; };
  climb.run(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 4U);
}

// A toe that goes down along the next riser.
TEST(GaitContact, ForceForAMomentInTheAir_GoesOnToTheGround) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    const LatchedStep& step = climb.status().step;
    const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns - 540 * kNsPerMs;
    if (climb.status().phase != GaitPhase::kSwing || step.sequence != 2 || since_ns < 0) return;
    if (since_ns < 8 * kNsPerMs) feedback.foot_force_n[index_of(step.foot)] = 60.0;
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  EXPECT_EQ(climb.status().early_contacts, 0U);
  EXPECT_LT(climb.record().execution_z_m, 0.003);
}

// A leg's acceleration feigns a force of some tens of newtons, and is gone once the foot stands still. What presses
// much harder is no acceleration, nor is what is felt for some time at rest.
TEST(GaitContact, ForceAboveTheTarget_LandsWhereNoAccelerationFeignsIt) {
  struct Case {
    double force_n;
    int lasts_ms;
    bool lands_early;
  };
  for (const Case& c : {Case{60.0, 24, false}, Case{60.0, 500, true}, Case{200.0, 24, true}}) {
    IdealClimb climb({});
    std::vector<double> heights_m;  // asked for while it is felt
    climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
      const LatchedStep& step = climb.status().step;
      const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns - 540 * kNsPerMs;
      if (climb.status().phase != GaitPhase::kSwing || step.sequence != 2 || since_ns < 0) return;
      if (since_ns >= c.lasts_ms * kNsPerMs) return;
      heights_m.push_back(climb.status().odom_T_sole_desired[index_of(step.foot)].p_m.z());
      feedback.foot_force_n[index_of(step.foot)] = c.force_n;
    };
    ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
    EXPECT_EQ(climb.status().early_contacts, c.lands_early ? 1U : 0U) << c.force_n << " N, " << c.lasts_ms << " ms";
    EXPECT_EQ(climb.touches(climb.status().step.foot), !c.lands_early);
    // Five samples tell of it, and are some 3 mm of the way; then it stands still.
    for (std::size_t n = 7; n < heights_m.size(); ++n) EXPECT_NEAR(heights_m[n], heights_m[6], 2e-4) << n;
    EXPECT_GT(heights_m.size(), 3U);
    test::expect_sound_commands(climb);
  }
}

// The last sample before the bus falls silent is of a toe that scrapes: it is one, however often it is read.
TEST(GaitContact, BusSilentAfterAScrape_IsNoGround) {
  IdealClimb climb({});
  JointFeedback last;
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    const LatchedStep& step = climb.status().step;
    const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns - 540 * kNsPerMs;
    if (climb.status().phase != GaitPhase::kSwing || step.sequence != 2 || since_ns < 0) return;
    if (since_ns == 0) {
      last = feedback;
      last.foot_force_n[index_of(step.foot)] = 60.0;
    }
    if (since_ns < 16 * kNsPerMs) feedback = last;
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  EXPECT_EQ(climb.status().early_contacts, 0U);
  EXPECT_LT(climb.record().execution_z_m, 0.003);
}

// A scrape stops the foot, the bus is silent for 60 ms, and the foot scrapes again: what it felt before counts no more.
TEST(GaitContact, BusSilentBetweenTwoScrapes_LandsWhereTheGroundIs) {
  IdealClimb climb({});
  JointFeedback last;
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    const LatchedStep& step = climb.status().step;
    const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns - 540 * kNsPerMs;
    if (climb.status().phase != GaitPhase::kSwing || step.sequence != 2 || since_ns < 0) return;
    const std::int64_t since_ms = since_ns / kNsPerMs;
    if (since_ms < 20 || (since_ms >= 80 && since_ms < 92)) feedback.foot_force_n[index_of(step.foot)] = 60.0;
    if (since_ms < 20) last = feedback;
    if (since_ms >= 20 && since_ms < 80) feedback = last;
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  EXPECT_EQ(climb.status().early_contacts, 0U);
  EXPECT_LT(climb.record().execution_z_m, 0.003);
}

// The base comes 10 mm off its plan: a foot that is hardly pressed must not go along.
TEST(GaitContact, LandedFootHardlyPressed_StaysWhereItLanded) {
  IdealClimb climb({});
  bool off = false;
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    double& force_n = feedback.foot_force_n[index_of(climb.status().step.foot)];
    if (climb.status().step.sequence == 2) force_n = std::min(force_n, 60.0);
    if (off) state.odom_T_base.p_m.x() += 0.01;
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  const std::size_t i = index_of(climb.status().step.foot);
  const Vec3 landed_m = climb.status().odom_T_sole_desired[i].p_m;
  for (int n = 0; n < 280; ++n) {
    off = n >= 150;
    climb.tick();
    ASSERT_EQ(climb.status().phase, GaitPhase::kDoubleSupport);
    EXPECT_LT((climb.status().odom_T_sole_desired[i].p_m - landed_m).norm(), 1e-3) << n;
  }
}

// A foot went back, and the body sways over it: the other one, lifted with the base 20 mm off its plan, must not go
// along.
TEST(GaitContact, FootLiftedAfterTheOtherOneWentBack_StaysWhereItStood) {
  IdealClimb climb({});
  bool off = false;
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    const LatchedStep& step = climb.status().step;
    const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns;
    if (climb.status().phase == GaitPhase::kSwing && step.onto_tread && since_ns > 20 * kNsPerMs &&
        since_ns < 80 * kNsPerMs) {
      state.odom_v_base_mps.y() += side_sign(step.foot) * 0.15;
    }
    if (off) state.odom_T_base.p_m.x() += 0.02;
    if (off) feedback.foot_force_n[index_of(other(step.foot))] = 0.0;
  };
  while (climb.tick() && climb.status().aborted_swings == 0) {
  }
  ASSERT_EQ(climb.status().aborted_swings, 1U);
  const std::size_t lifted = index_of(other(climb.status().step.foot));
  const Vec3 stood_m = climb.status().odom_T_sole_desired[lifted].p_m;
  off = true;
  for (int n = 0; n < 200; ++n) {
    climb.tick();
    ASSERT_EQ(climb.status().phase, GaitPhase::kDoubleSupport);
    EXPECT_LT((climb.status().odom_T_sole_desired[lifted].p_m - stood_m).norm(), 2e-3) << n;
  }
}

// On two feet the base is 20 mm off its plan. It moves on at first_mps, if that is not 0, while both feet are pressed,
// then at then_mps, and one foot loses its load: how far that one is asked to go.
struct Throw {
  double first_mps = 0.0;
  double then_mps = 0.0;
};
double lifted_foot_moves_m(const Throw& thrown, const Gait::Params& params = {}) {
  IdealClimb climb({}, params);
  enum class Off : std::uint8_t { kNot, kThrown, kPressed, kLifted } off = Off::kNot;
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    if (off == Off::kNot) return;
    state.odom_T_base.p_m.x() += 0.02;
    state.odom_v_base_mps.x() += off == Off::kThrown ? thrown.first_mps : thrown.then_mps;
    if (off == Off::kLifted) feedback.foot_force_n[index_of(other(climb.status().step.foot))] = 0.0;
  };
  EXPECT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  for (int n = 0; n < 150; ++n) climb.tick();  // the one that landed is pressed, and held no longer
  const std::size_t lifted = index_of(other(climb.status().step.foot));
  const Vec3 stood_m = climb.status().odom_T_sole_desired[lifted].p_m;
  if (thrown.first_mps > 0.0) {
    off = Off::kThrown;
    for (int n = 0; n < 10; ++n) climb.tick();
    off = Off::kPressed;
    for (int n = 0; n < 5; ++n) climb.tick();
  }
  off = Off::kLifted;
  double moved_m = 0.0;
  for (int n = 0; n < 100; ++n) {
    climb.tick();
    EXPECT_EQ(climb.status().phase, GaitPhase::kDoubleSupport);
    moved_m = std::max(moved_m, (climb.status().odom_T_sole_desired[lifted].p_m - stood_m).norm());
  }
  return moved_m;
}
TEST(GaitContact, FootLiftedWhileTheBodyIsThrown_StaysWhereItStood) {
  EXPECT_LT(lifted_foot_moves_m({0.0, 0.15}), 2e-3);
}
// A throw is over when the body is back, not as soon as it comes back.
TEST(GaitContact, FootLiftedWhileAThrownBodyComesBack_StaysWhereItStood) {
  EXPECT_LT(lifted_foot_moves_m({0.15, 0.07}), 2e-3);
  Gait::Params at_once;
  at_once.landed_foot.caught_m = at_once.landed_foot.thrown_m;
  EXPECT_GT(lifted_foot_moves_m({0.15, 0.07}, at_once), 1e-2);
}
// Held feet are planned elsewhere to each other than they stand: no reason for that where nothing is thrown.
TEST(GaitContact, FootLiftedWhileTheBodyIsALittleOff_GoesAlong) { EXPECT_GT(lifted_foot_moves_m({}), 1e-2); }

// Of a foot that turns back soon after it left: where it ends, and the least on the way, ahead of where its path
// begins.
struct WayBack {
  Vec3 end_m = Vec3::Zero();
  double least_m = 0.0;
};
// Legs that give way under load: the soles stand off_m ahead of their plan.
WayBack way_back(double off_m) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback&) {
    for (Transform& odom_T_sole : state.odom_T_sole) odom_T_sole.p_m.x() += off_m;
    const LatchedStep& step = climb.status().step;
    const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns;
    if (climb.status().phase == GaitPhase::kSwing && step.onto_tread && since_ns > 20 * kNsPerMs &&
        since_ns < 80 * kNsPerMs) {
      state.odom_v_base_mps.y() += side_sign(step.foot) * 0.15;
    }
  };
  while (climb.tick() && !in_swing_onto_tread(climb, 1)) {
  }
  const std::size_t foot = index_of(climb.status().step.foot);
  const Vec3 begin_m = climb.status().odom_T_sole_desired[foot].p_m;
  WayBack way;
  while (climb.tick() && climb.status().aborted_swings == 0) {
    way.least_m = std::min(way.least_m, climb.status().odom_T_sole_desired[foot].p_m.x() - begin_m.x());
  }
  EXPECT_EQ(climb.status().aborted_swings, 1U);
  way.end_m = climb.status().odom_T_sole_desired[foot].p_m - begin_m;
  return way;
}
TEST(GaitContact, FootThatGoesBack_StandsWhereItStoodAndNotWhereItWasPlanned) {
  constexpr double kOff_m = 0.008;
  const WayBack as_planned = way_back(0.0), ahead = way_back(kOff_m);
  EXPECT_NEAR(as_planned.end_m.x(), 0.0, 1e-3);
  EXPECT_NEAR(ahead.end_m.x(), kOff_m, 1e-3);
  EXPECT_NEAR(ahead.end_m.y(), 0.0, 1e-3);
  EXPECT_GT(ahead.least_m, as_planned.least_m - 1e-3);  // while its pace turns, it does not go the other way
}

TEST(GaitContact, BumpInTheAir_HoldsTheReferenceWithoutAJump) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    const LatchedStep& step = climb.status().step;
    if (step.sequence == 2 && state.stamp_ns - step.latch_stamp_ns > 540 * kNsPerMs) {
      feedback.foot_force_n[index_of(step.foot)] = 60.0;  // 30 mm above the floor, in the fastest part of the landing
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
  test::expect_sound_commands(climb);
}

// A toe hangs on an edge above its target, and slips off it before the weight comes.
TEST(GaitContact, HangsForAMomentInTheAir_IsLoweredToTheGround) {
  IdealClimb climb({});
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback& feedback) {
    const LatchedStep& step = climb.status().step;
    const std::int64_t since_ns = state.stamp_ns - step.latch_stamp_ns - 540 * kNsPerMs;
    if (step.sequence == 2 && since_ns > 0 && since_ns < 60 * kNsPerMs) {
      feedback.foot_force_n[index_of(step.foot)] = 60.0;
    }
  };
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  EXPECT_EQ(climb.status().early_contacts, 1U);
  const Foot foot = climb.status().step.foot;
  EXPECT_FALSE(climb.touches(foot));
  const double landed_m = climb.true_T_sole(foot).p_m.z();
  for (int n = 0; n < 250; ++n) climb.tick();
  EXPECT_EQ(climb.status().phase, GaitPhase::kDoubleSupport);
  EXPECT_TRUE(climb.touches(foot));
  EXPECT_GT(landed_m - climb.true_T_sole(foot).p_m.z(), 0.01);
  test::expect_sound_commands(climb);
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

}  // namespace
}  // namespace polygmap
