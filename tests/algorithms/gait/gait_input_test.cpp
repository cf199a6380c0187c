// SPDX-License-Identifier: Apache-2.0
// Readings and estimates that are none.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/support/gait_checks.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

using test::IdealClimb;

TEST(GaitInput, NotInitialised_HoldsTheMeasuredJointsAndNeverMoves) {
  Gait gait;
  gait.reset({}, nominal_robot());
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
    gait.reset({}, nominal_robot());
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
  gait.reset({}, nominal_robot());
  JointFeedback feedback;
  feedback.q_rad[kKnee] = -0.01;
  JointCommand command;
  gait.tick(0, {}, {}, feedback, command);
  EXPECT_GT(command.joints[kKnee].kp_nmprad, 0.0);
  EXPECT_EQ(command.joints[kKnee].q_rad, 0.0);
}

// What the gait is told before the estimate's first, tick 251, and what becomes of it.
GaitStatus before_the_estimate(IdealClimb& climb, const std::function<void(StateEstimate&)>& told) {
  climb.tamper = [&](StateEstimate& state, FootholdSet&, JointFeedback&) {
    if (climb.tick_count() > 100) told(state);
  };
  while (climb.tick_count() < 240) (void)climb.tick();
  EXPECT_TRUE(climb.gait().armed());
  const GaitStatus before = climb.status();
  for (int i = 0; i < 1000; ++i) (void)climb.tick();
  EXPECT_EQ(climb.status().phase, before.phase) << "for good";
  EXPECT_EQ(climb.status().stop_reason, before.stop_reason);
  EXPECT_LT(climb.true_T_base().p_m.z(), kNominalBaseHeight_m + 1e-3);
  test::expect_sound_commands(climb);
  return before;
}

TEST(GaitInput, StopRequestedBeforeTheEstimate_StopsStandingForThatReason) {
  IdealClimb climb({});
  const GaitStatus status =
      before_the_estimate(climb, [&](StateEstimate&) { climb.gait().request_stop(StopReason::kTimeShort); });
  EXPECT_EQ(status.phase, GaitPhase::kStopped);
  EXPECT_EQ(status.stop_reason, StopReason::kTimeShort);
  EXPECT_TRUE(status.stands[0] && status.stands[1]);
}

TEST(GaitInput, SamplesGrowOldBeforeTheEstimate_StopsStandingAsStale) {
  IdealClimb climb({});
  std::int64_t oldest_ns = -1;
  const GaitStatus status = before_the_estimate(climb, [&](StateEstimate& state) {
    if (oldest_ns < 0) oldest_ns = state.oldest_input_ns;
    if (climb.tick_count() < 240) state.oldest_input_ns = oldest_ns;
  });
  EXPECT_EQ(status.phase, GaitPhase::kStopped);
  EXPECT_EQ(status.stop_reason, StopReason::kStateStale);
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
  test::expect_sound_commands(climb);
}
}  // namespace
}  // namespace polygmap
