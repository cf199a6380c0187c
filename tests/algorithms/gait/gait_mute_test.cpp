// SPDX-License-Identifier: Apache-2.0
// A drive says nothing any more and holds its last command, the others go on: the body stays where it is, and a foot in
// the air comes down.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace polygmap
