// SPDX-License-Identifier: Apache-2.0
// A drive says nothing any more and holds its last command, the others go on: the body stays where it is, and a foot in
// the air comes down.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>

#include "tests/support/gait_checks.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

using test::IdealClimb;

// From the next tick on, for so long.
void mute(IdealClimb& climb, std::int64_t for_ns = INT64_MAX / 4) {
  climb.tamper = [since_ns = std::int64_t{-1}, for_ns](StateEstimate& state, FootholdSet&, JointFeedback&) mutable {
    if (since_ns < 0) since_ns = state.oldest_input_ns;
    state.heard_ns = state.oldest_input_ns;
    if (state.oldest_input_ns - since_ns < for_ns) state.oldest_input_ns = since_ns;
  };
}
void tick(IdealClimb& climb, int ticks) {
  for (int i = 0; i < ticks; ++i) (void)climb.tick();
}
// Greatest difference of a leg's commanded angles.
double moved_rad(const JointCommand& a, const JointCommand& b, Foot leg) {
  double most = 0.0;
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const std::size_t n = joint_index(leg, j);
    most = std::max(most, std::abs(a.joints[n].q_rad - b.joints[n].q_rad));
  }
  return most;
}
constexpr int kSteered_ticks = 12;  // 20 ms, and the lead for the drives' delay

TEST(GaitMute, WhileTheWeightMoves_JointsStayAndItStops) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 4));
  tick(climb, 60);
  ASSERT_EQ(climb.status().phase, GaitPhase::kDoubleSupport);
  const JointCommand moving = climb.command();
  tick(climb, 5);
  ASSERT_GT(moved_rad(climb.command(), moving, Foot::kLeft), 1e-4) << "it moved at all";
  mute(climb);
  tick(climb, kSteered_ticks);
  const JointCommand held = climb.command();
  tick(climb, 45 - kSteered_ticks);
  EXPECT_NE(climb.status().phase, GaitPhase::kStopped);
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) EXPECT_LT(moved_rad(climb.command(), held, leg), 1e-12);
  tick(climb, 10);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kStateStale);
}

TEST(GaitMute, LateInASwing_StandingLegStaysAndTheFootLands) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
  tick(climb, 200);
  ASSERT_EQ(climb.status().phase, GaitPhase::kSwing);
  const Foot stance = other(climb.status().step.foot);
  mute(climb);
  tick(climb, kSteered_ticks);
  const JointCommand held = climb.command();
  int ticks = kSteered_ticks;
  while (climb.status().phase == GaitPhase::kSwing && ++ticks < 700 && climb.tick()) {
    if (climb.status().phase != GaitPhase::kSwing) break;
    ASSERT_LT(moved_rad(climb.command(), held, stance), 1e-12);
  }
  EXPECT_EQ(climb.status().aborted_swings, 0U);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
  tick(climb, 60);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kStateStale);
  EXPECT_TRUE(climb.touches(Foot::kLeft) && climb.touches(Foot::kRight));
}

TEST(GaitMute, EarlyInASwing_FootGoesBackToWhereItStood) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
  const Foot foot = climb.status().step.foot;
  const Vec3 stood_m = climb.true_T_sole(foot).p_m;
  tick(climb, 20);
  mute(climb);
  tick(climb, 350);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kStateStale);
  EXPECT_EQ(climb.status().aborted_swings, 1U);
  EXPECT_TRUE(climb.touches(foot));
  EXPECT_LT((climb.true_T_sole(foot).p_m - stood_m).norm(), 0.02);
}

TEST(GaitMute, ForSixtyMilliseconds_ClimbsOn) {
  for (const auto phase : {GaitPhase::kDoubleSupport, GaitPhase::kSwing}) {
    for (const int after_ticks : {20, 100, 200}) {
      IdealClimb climb({});
      ASSERT_TRUE(climb.run_until(phase, 4));
      tick(climb, after_ticks);
      mute(climb, 60 * kNsPerMs);
      climb.run(60.0);
      EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << name_of(phase) << after_ticks;
      EXPECT_EQ(climb.status().treads_climbed, 4U);
      EXPECT_EQ(climb.status().aborted_swings, 0U) << name_of(phase) << after_ticks;
    }
  }
}

// Silent for 0.3 s, then not: by then it has to stop, and nothing jumps when the drive answers.
TEST(GaitMute, AnswersAgainTooLate_StopsWhereItIsWithoutAJump) {
  constexpr double kMost_rad = 0.004;  // of a joint in a tick, when it stands: 2 rad/s
  for (const auto phase : {GaitPhase::kDoubleSupport, GaitPhase::kSwing}) {
    for (const int after_ticks : {20, 100, 300}) {
      SCOPED_TRACE(std::string(name_of(phase)) + " " + std::to_string(after_ticks));
      IdealClimb climb({});
      ASSERT_TRUE(climb.run_until(phase, 4));
      tick(climb, after_ticks);
      mute(climb, 300 * kNsPerMs);
      for (int ticks = 0; ticks < 1500; ++ticks) {
        const JointCommand before = climb.command();
        const bool stood = climb.status().phase == GaitPhase::kStopped;
        tick(climb, 1);
        for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
          if (stood) {
            ASSERT_LT(moved_rad(climb.command(), before, leg), kMost_rad) << ticks;
          }
        }
      }
      EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
      EXPECT_EQ(climb.status().stop_reason, StopReason::kStateStale);
      EXPECT_TRUE(climb.touches(Foot::kLeft) && climb.touches(Foot::kRight));
    }
  }
}

// Everything silent for 0.2 s of a swing: the foot comes down as planned, and that was its last.
TEST(GaitMute, AllSilentForTooLongInASwing_StopsWhenTheFootHasLanded) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
  tick(climb, 100);
  climb.tamper = [since_ns = std::int64_t{-1}](StateEstimate& state, FootholdSet&, JointFeedback&) mutable {
    if (since_ns < 0) since_ns = state.oldest_input_ns;
    if (state.oldest_input_ns - since_ns < 200 * kNsPerMs) state.oldest_input_ns = state.heard_ns = since_ns;
  };
  tick(climb, 800);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kStateStale);
  EXPECT_EQ(climb.status().step.sequence, 4U);
}

// A drive that is silent from the next tick on, for so long, and a foot whose force tells of nothing from then on.
struct Silence {
  std::size_t joint = 0;
  int ticks = 1'000'000;
  std::optional<Foot> unfelt = std::nullopt;
};
void silence(IdealClimb& climb, const Silence& silence) {
  climb.tamper = [silence, n = 0, since_ns = std::int64_t{0}, held_rad = 0.0](StateEstimate& state, FootholdSet&,
                                                                              JointFeedback& feedback) mutable {
    if (silence.unfelt) feedback.foot_force_n[index_of(*silence.unfelt)] = 0.0;
    state.heard_ns = state.oldest_input_ns;
    double& angle_rad = feedback.q_rad[static_cast<Eigen::Index>(silence.joint)];
    if (n == 0) {
      since_ns = state.oldest_input_ns;
      held_rad = angle_rad;
    }
    if (n >= silence.ticks) return;
    state.oldest_input_ns = since_ns;
    angle_rad = held_rad;
    feedback.silent_cycles[silence.joint] = static_cast<std::uint16_t>(std::min(n++, 60'000));
  };
}
// Greatest change of a commanded angle from one tick to the next.
double largest_step_rad(IdealClimb& climb, int ticks) {
  double most = 0.0;
  for (int i = 0; i < ticks; ++i) {
    const JointCommand before = climb.command();
    tick(climb, 1);
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) most = std::max(most, moved_rad(climb.command(), before, leg));
  }
  return most;
}
// Where the standing leg's command has the base.
Vec3 base_m(const IdealClimb& climb, Foot stance) {
  JointVector q_rad;
  for (std::size_t n = 0; n < kJointCount; ++n) q_rad[static_cast<Eigen::Index>(n)] = climb.command().joints[n].q_rad;
  return base_T_sole(nominal_robot().legs, stance, leg_joints(q_rad, stance)).inverse().p_m;
}
void expect_stopped_as_stale(const IdealClimb& climb) {
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kStateStale);
  EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
}

TEST(GaitMute, KneeAnswersWhileTheBodyComesDown_ComesDownOn) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
  tick(climb, 100);
  const Foot foot = climb.status().step.foot, stance = other(foot);
  const double high_m = base_m(climb, stance).z();
  silence(climb, {.joint = joint_index(foot, kKnee), .unfelt = foot});
  int ticks = 0;
  while (++ticks < 2000 && base_m(climb, stance).z() > high_m - 0.05) tick(climb, 1);
  ASSERT_EQ(climb.status().phase, GaitPhase::kSwing);
  ASSERT_LT(ticks, 2000) << "it comes down";
  silence(climb, {.joint = joint_index(foot, kKnee), .ticks = 0, .unfelt = foot});  // it answers
  const double low_m = base_m(climb, stance).z();
  EXPECT_LT(largest_step_rad(climb, 1500), 0.006);
  EXPECT_LT(base_m(climb, stance).z(), low_m);
  EXPECT_EQ(climb.status().aborted_swings, 0U);
  expect_stopped_as_stale(climb);
}

TEST(GaitMute, AnswersAgainAfterTheStop_JointsStay) {
  for (const bool in_the_air : {false, true}) {
    IdealClimb climb({});
    ASSERT_TRUE(climb.run_until(in_the_air ? GaitPhase::kSwing : GaitPhase::kDoubleSupport, 4));
    tick(climb, in_the_air ? 200 : 60);
    const Foot stance = other(climb.status().step.foot);
    mute(climb, 2 * kNsPerS);
    tick(climb, kSteered_ticks);
    const Vec3 before_m = base_m(climb, stance);
    tick(climb, 900);
    expect_stopped_as_stale(climb);
    EXPECT_NEAR((base_m(climb, stance) - before_m).norm(), in_the_air ? 0.05 : 0.0, 0.005) << "leant";
    const JointCommand held = climb.command();
    tick(climb, 1000);
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) EXPECT_LT(moved_rad(climb.command(), held, leg), 1e-3);
  }
}

// The leg in the air has moved meanwhile, and with it the centre of mass.
TEST(GaitMute, AnswersAgainInASwing_BaseGoesOnFromWhereItIs) {
  for (const int after_ticks : {60, 100, 140}) {
    IdealClimb climb({});
    ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
    tick(climb, after_ticks);
    const Foot stance = other(climb.status().step.foot);
    mute(climb, 90 * kNsPerMs);
    tick(climb, 45);
    double most_m = 0.0;
    for (int i = 0; i < 10; ++i) {
      const Vec3 before_m = base_m(climb, stance);
      tick(climb, 1);
      most_m = std::max(most_m, (base_m(climb, stance) - before_m).norm());
    }
    EXPECT_LT(most_m, 0.002) << after_ticks;
  }
}

TEST(GaitMute, FootThatHangs_IsNotLeantTo) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
  tick(climb, 100);
  const Foot foot = climb.status().step.foot, stance = other(foot);
  silence(climb, {.joint = joint_index(foot, kKnee), .unfelt = foot});
  tick(climb, kSteered_ticks);
  const Vec3 before_m = base_m(climb, stance);
  tick(climb, 2500);
  expect_stopped_as_stale(climb);
  const Vec3 way_m = base_m(climb, stance) - before_m;
  EXPECT_LT(way_m.z(), -0.19);
  EXPECT_LT(way_m.head<2>().norm(), 1e-6);
}

TEST(GaitMute, FootFindsNoGroundThoughItsOwnLegSpeaks_GoesBack) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
  tick(climb, 150);
  const Foot foot = climb.status().step.foot, stance = other(foot);
  silence(climb, {.joint = joint_index(stance, kHipYaw), .unfelt = foot});
  tick(climb, kSteered_ticks);
  const Vec3 before_m = base_m(climb, stance);
  tick(climb, 3000);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kGroundMissing);
  EXPECT_LT((base_m(climb, stance) - before_m).norm(), 1e-6);
}

TEST(GaitMute, LateInAWeightShift_FootLiftsLaterByAsLong) {
  IdealClimb reference({});
  ASSERT_TRUE(reference.run_until(GaitPhase::kSwing, 5));
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 4));
  while (climb.tick_count() < reference.tick_count() - 55) tick(climb, 1);
  mute(climb, 90 * kNsPerMs);
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 5));
  EXPECT_GE(climb.tick_count(), reference.tick_count() + 34);
}

TEST(GaitMute, KneeMissesOneReply_CommandsAreThoseOfAKneeThatSpeaks) {
  std::array<JointCommand, 2> commands;
  for (const bool misses : {false, true}) {
    IdealClimb climb({});
    ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
    tick(climb, 100);
    const Foot foot = climb.status().step.foot;
    silence(climb, {.joint = joint_index(foot, kHipRoll)});
    climb.tamper = [foot, misses, silent = climb.tamper](StateEstimate& state, FootholdSet& set,
                                                         JointFeedback& feedback) {
      silent(state, set, feedback);
      feedback.silent_cycles[joint_index(foot, kKnee)] = misses ? 1 : 0;
    };
    tick(climb, 30);
    commands[misses ? 1 : 0] = climb.command();
  }
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) EXPECT_LT(moved_rad(commands[0], commands[1], leg), 1e-12);
}

// Told of a foot that feels nothing, the knee would otherwise be commanded to where it happens to be measured.
TEST(GaitMute, KneeAnswersInTheAirTooLate_StaysAsCommanded) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 4));
  tick(climb, 100);
  const Foot foot = climb.status().step.foot;
  const std::size_t knee = joint_index(foot, kKnee);
  silence(climb, {.joint = knee, .ticks = 80, .unfelt = foot});
  tick(climb, 85);
  ASSERT_EQ(climb.status().phase, GaitPhase::kSwing);
  const double held_rad = climb.command().joints[knee].q_rad;
  climb.tamper = [knee, answers = climb.tamper](StateEstimate& state, FootholdSet& set, JointFeedback& feedback) {
    answers(state, set, feedback);
    feedback.q_rad[static_cast<Eigen::Index>(knee)] -=
        0.05;  // its weight bends it back, as far as its stiffness lets it
  };
  tick(climb, 40);
  ASSERT_EQ(climb.status().phase, GaitPhase::kSwing);
  EXPECT_NEAR(climb.command().joints[knee].q_rad, held_rad, 1e-3);
}

// Both a way beside the standing foot and a straight one ask of the drives what no plan has proved for those that were
// silent.
TEST(GaitMute, SeemsToToppleAfterALongSilence_PassingFootKeepsToItsTarget) {
  Gait::Params params;
  params.planner.pattern = GaitPattern::kSingleStep;
  IdealClimb climb({}, params);
  const auto passes = [&climb] {
    const auto& done = climb.record().steps;
    const bool second = std::count_if(done.begin(), done.end(), [](const auto& step) { return step.onto_tread; }) == 2;
    return second && climb.status().phase == GaitPhase::kSwing;
  };
  while (!passes() && climb.tick()) {
  }
  ASSERT_TRUE(passes());
  const LatchedStep latched = climb.status().step;
  tick(climb, 70);
  mute(climb, 120 * kNsPerMs);
  climb.tamper = [silent = climb.tamper, n = 0, side = side_sign(latched.foot)](StateEstimate& state, FootholdSet& set,
                                                                                JointFeedback& feedback) mutable {
    silent(state, set, feedback);
    if (++n > 80 && n < 120) state.odom_v_base_mps.y() += side * 0.15;
  };
  tick(climb, 1500);
  expect_stopped_as_stale(climb);
  EXPECT_EQ(climb.status().step.sequence, latched.sequence);
  EXPECT_EQ(climb.status().aborted_swings, 0U);
  EXPECT_EQ((climb.status().step.odom_T_target.p_m - latched.odom_T_target.p_m).norm(), 0.0);
}

}  // namespace
}  // namespace polygmap
