// SPDX-License-Identifier: Apache-2.0
// The module with an operator: nothing begins before it is asked for, and what was stopped begins anew when it may.
#include <gtest/gtest.h>

#include "firmware/operator_answer_text.hpp"
#include "tests/support/fakes/fake_operator_input.hpp"
#include "tests/support/standing_module.hpp"

namespace polygmap {
namespace {

class OperatedModule : public test::StandingModule {
 protected:
  static Params params() {
    Params params;
    params.supervisor.autostart = false;
    return params;
  }
  OperatedModule() : StandingModule(params(), &operator_) {}
  void ask(OperatorCommand command, int ticks) {
    operator_.ask(command);
    stand(ticks);
  }
  [[nodiscard]] ModuleState state() const { return control().module_state(); }
  // Of the last command asked; kNone where it was obeyed.
  [[nodiscard]] Refusal refusal(JointSet* joints = nullptr) {
    OperatorAnswer answer;
    bool any = false;
    while (operator_.try_take_answer(answer)) any = true;
    EXPECT_TRUE(any) << "nobody answered";
    if (joints != nullptr) *joints = answer.joints;
    return answer.refusal;
  }
  [[nodiscard]] double knee_kp_nmprad() const { return joints_.commands().newest().joints[3].kp_nmprad; }

  fakes::FakeOperatorInput operator_;
};

TEST_F(OperatedModule, NotAskedToArm_StaysOffWithoutGains) {
  stand(500);
  EXPECT_EQ(state(), ModuleState::kOff);
  EXPECT_EQ(knee_kp_nmprad(), 0.0);
  EXPECT_EQ(joints_.writes.calls(), 500U) << "its drives are asked where they are";
  ask(OperatorCommand::kArm, 2);
  EXPECT_EQ(state(), ModuleState::kStanding);
  EXPECT_GT(knee_kp_nmprad(), 0.0);
}

TEST_F(OperatedModule, NotStarted_StandsForEver_AndWaitsForStairsOnlyFromThen) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  ASSERT_TRUE(control().state().initialised);
  stand(4000);
  EXPECT_EQ(state(), ModuleState::kStanding) << "without stairs in view a started module stops after three seconds";
  ask(OperatorCommand::kStart, 1400);
  EXPECT_EQ(state(), ModuleState::kWalkingUp);
  stand(200);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kNothingSeen);
}

TEST_F(OperatedModule, Paused_WaitsForNothing) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  ask(OperatorCommand::kStart, 1000);
  ask(OperatorCommand::kPause, 3000);
  EXPECT_EQ(state(), ModuleState::kHolding);
  ask(OperatorCommand::kResume, 1400);
  EXPECT_EQ(state(), ModuleState::kWalkingUp);
  stand(200);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
}

TEST_F(OperatedModule, Stopped_StandsAgainAfterAResetAndStartsAnew) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  ask(OperatorCommand::kStart, 100);
  ask(OperatorCommand::kStop, 2);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kOperator);
  ask(OperatorCommand::kStart, 2);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
  EXPECT_EQ(count(Limit::kOperatorRefused), 1U);
  for (int round = 0; round < 3; ++round) {
    ask(OperatorCommand::kReset, 2);
    EXPECT_EQ(state(), ModuleState::kStanding);
    EXPECT_EQ(control().gait_status().stop_reason, StopReason::kNone);
    ask(OperatorCommand::kStart, 2);
    EXPECT_EQ(state(), ModuleState::kWalkingUp);
    stand(1600);
    EXPECT_EQ(state(), ModuleState::kSafeStop) << "there are no stairs";
  }
  EXPECT_EQ(count(Limit::kOperatorRefused), 1U);
  EXPECT_EQ(count(Fault::kGaitStopped), 4U);
}

TEST_F(OperatedModule, ResetWhileItsCauseLasts_IsRefused) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  joints_.told.drive_errors.insert(4);
  stand(3);
  ASSERT_EQ(state(), ModuleState::kSafeStop);
  ASSERT_EQ(control().gait_status().stop_reason, StopReason::kDriveError);
  ask(OperatorCommand::kReset, 2);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
  EXPECT_EQ(count(Limit::kOperatorRefused), 1U);
  JointSet joints;
  EXPECT_EQ(refusal(&joints), Refusal::kDrivesInError);
  EXPECT_EQ(joints.bits(), 1U << 4U);
  joints_.told.drive_errors = {};
  stand(1);
  ask(OperatorCommand::kReset, 2);
  EXPECT_EQ(state(), ModuleState::kStanding);
  EXPECT_EQ(refusal(), Refusal::kNone);
}

TEST_F(OperatedModule, DriveIsTooHot_StopsAndIsResetOnceItHasCooled) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  joints_.told.drive_degc[3] = 120;
  stand(3);
  ASSERT_EQ(state(), ModuleState::kSafeStop);
  ASSERT_EQ(control().gait_status().stop_reason, StopReason::kDriveHot);
  EXPECT_GT(knee_kp_nmprad(), 0.0) << "it holds on";
  joints_.told.drive_degc[3] = 80;
  ask(OperatorCommand::kReset, 2);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
  OperatorAnswer answer;
  while (operator_.try_take_answer(answer)) {
  }
  EXPECT_EQ(text_of(answer, state()).view(), "refused: safe_stop, too hot: left_knee");
  joints_.told.drive_degc[3] = 75;
  stand(1);
  ask(OperatorCommand::kReset, 2);
  EXPECT_EQ(state(), ModuleState::kStanding);
  EXPECT_EQ(count(Fault::kDriveHot), 1U);
  EXPECT_TRUE(control().drives().hot.is_empty());
  EXPECT_EQ(control().drives().ever_hot.bits(), 1U << 3U);
}

// Of the others the answer's text names the reason; the drives' are above and below.
TEST_F(OperatedModule, ResetOfASafeStop_IsRefusedForWhatLasts) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  ask(OperatorCommand::kStart, 100);
  EXPECT_EQ(refusal(), Refusal::kNone);
  ask(OperatorCommand::kReset, 1);
  EXPECT_EQ(refusal(), Refusal::kState);
  ask(OperatorCommand::kStop, 2);
  ASSERT_EQ(state(), ModuleState::kSafeStop);
  EXPECT_EQ(refusal(), Refusal::kNone);

  joints_.writes.fail_next();
  stand(1);
  ask(OperatorCommand::kReset, 1);
  EXPECT_EQ(refusal(), Refusal::kCommandRefused);

  // Slower than what would be taken for a jump, faster than what two feet creep apart.
  for (int i = 0; i < 250; ++i) {
    standing_q_rad_[9] += 0.0020;
    stand(1);
  }
  ask(OperatorCommand::kReset, 1);
  JointSet joints;
  EXPECT_EQ(refusal(&joints), Refusal::kJointsAway);
  EXPECT_EQ(joints.bits(), 1U << 9U);
  for (int i = 0; i < 250; ++i) {
    standing_q_rad_[9] -= 0.0020;
    stand(1);
  }

  foot_force_n_[1] = 0.0;
  stand(100);
  ask(OperatorCommand::kReset, 1);
  EXPECT_EQ(refusal(), Refusal::kFootLifted);
  foot_force_n_[1] = 270.0;
  stand(100);

  for (int i = 0; i < 50; ++i) {
    if (i == 49) operator_.ask(OperatorCommand::kReset);
    clock_.advance_ns(kCycle_ns);
    const JointFeedback feedback = joints_at(clock_.now_ns());
    tick_with(nullptr, &feedback);
  }
  EXPECT_EQ(refusal(), Refusal::kEstimateStale);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
  EXPECT_EQ(count(Limit::kOperatorRefused), 5U);

  stand(100);
  ask(OperatorCommand::kReset, 2);
  EXPECT_EQ(refusal(), Refusal::kNone);
  EXPECT_EQ(state(), ModuleState::kStanding);
}

// The drive of a knee falls silent, and the robot stands on.
TEST_F(OperatedModule, MuteKneeAnswersAgain_StandsAfterAResetAndNotBefore) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  ask(OperatorCommand::kStart, 100);
  std::uint16_t silent = 0;
  const auto stand_mute = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      clock_.advance_ns(kCycle_ns);
      const ImuSample imu = imu_at(clock_.now_ns());
      JointFeedback joints = joints_at(clock_.now_ns());
      joints.silent_cycles[kKnee] = ++silent;
      tick_with(&imu, &joints);
    }
  };
  stand_mute(1000);
  ASSERT_EQ(state(), ModuleState::kSafeStop);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kStateStale);
  operator_.ask(OperatorCommand::kReset);
  stand_mute(2);
  EXPECT_EQ(state(), ModuleState::kSafeStop) << "the knee is mute";
  JointSet joints;
  EXPECT_EQ(refusal(&joints), Refusal::kDrivesSilent);
  EXPECT_EQ(joints.bits(), 1U << kKnee);
  EXPECT_EQ(count(Limit::kOperatorRefused), 1U);
  stand(100);
  EXPECT_EQ(state(), ModuleState::kSafeStop) << "nobody asked";
  ask(OperatorCommand::kReset, 2);
  EXPECT_EQ(state(), ModuleState::kStanding);
  ask(OperatorCommand::kStart, 1000);
  EXPECT_EQ(state(), ModuleState::kWalkingUp) << "its leg is whole again";
  EXPECT_EQ(count(Limit::kOperatorRefused), 1U);
  EXPECT_EQ(count(Fault::kDriveSilent), 1U);
}

TEST_F(OperatedModule, HandsOver_HoldsAsItStandsAndThenSendsNothing) {
  const HandOver::Params params;
  ask(OperatorCommand::kArm, kInitialised_ticks);
  const JointCommand balanced = joints_.commands().newest();
  ask(OperatorCommand::kHandOver, 1);
  EXPECT_EQ(state(), ModuleState::kHandingOver);
  EXPECT_EQ(refusal(), Refusal::kNone);
  EXPECT_EQ(knee_kp_nmprad(), balanced.joints[3].kp_nmprad) << "it balances on";
  stand(params.rest_ticks);
  EXPECT_EQ(state(), ModuleState::kHandingOver);
  const std::size_t sent = joints_.writes.calls();
  stand(params.hold_ticks + 50);
  EXPECT_EQ(state(), ModuleState::kReleased);
  const std::size_t more = joints_.writes.calls() - sent;
  EXPECT_LE(more, static_cast<std::size_t>(params.hold_ticks) + 2);
  const JointCommand held = joints_.commands().newest();
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const JointSetpoint& joint = held.joints[n];
    EXPECT_EQ(joint.kp_nmprad, RobotModel{}.drives.kp_blind_of(n)) << n;
    EXPECT_EQ(joint.dq_radps, 0.0);
    EXPECT_NEAR(joint.q_rad, standing_q_rad_[static_cast<Eigen::Index>(n)], 0.01);
    const JointSetpoint& before = balanced.joints[n];
    const double stood_by_nm =
        before.tau_ff_nm + before.kp_nmprad * (before.q_rad - standing_q_rad_[static_cast<Eigen::Index>(n)]);
    EXPECT_NEAR(joint.tau_ff_nm, stood_by_nm, 5.0) << n;
  }
  const std::uint32_t missing = count(Fault::kJointFeedbackMissing);
  for (int i = 0; i < 100; ++i) {  // nobody answers a module that asks nothing
    clock_.advance_ns(kCycle_ns);
    const ImuSample imu = imu_at(clock_.now_ns());
    tick_with(&imu, nullptr);
  }
  EXPECT_EQ(joints_.writes.calls(), sent + more);
  EXPECT_EQ(count(Fault::kJointFeedbackMissing), missing);
  for (const OperatorCommand command : {OperatorCommand::kArm, OperatorCommand::kReset, OperatorCommand::kStop}) {
    ask(command, 2);
    EXPECT_EQ(refusal(), Refusal::kState);
  }
  EXPECT_EQ(state(), ModuleState::kReleased);
}

TEST_F(OperatedModule, RobotSwaysWhileItHandsOver_IsBalancedUntilItRests) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  ask(OperatorCommand::kStart, 100);
  ask(OperatorCommand::kHandOver, 1);
  EXPECT_EQ(refusal(), Refusal::kState) << "it has to stand";
  ask(OperatorCommand::kStop, 2);
  ask(OperatorCommand::kHandOver, 1);
  ASSERT_EQ(state(), ModuleState::kHandingOver);
  for (int i = 0; i < 1500; ++i) {  // to and fro, by less than a lean
    clock_.advance_ns(kCycle_ns);
    ImuSample imu = imu_at(clock_.now_ns());
    imu.gyro_radps.y() = (i / 100) % 2 == 0 ? 0.2 : -0.2;
    const JointFeedback joints = joints_at(clock_.now_ns());
    tick_with(&imu, &joints);
    ASSERT_EQ(state(), ModuleState::kHandingOver);
  }
  EXPECT_LT(knee_kp_nmprad(), RobotModel{}.drives.kp_blind_of(3));
  ask(OperatorCommand::kStop, 2);
  EXPECT_EQ(state(), ModuleState::kSafeStop) << "it was asked not to";
  stand(1000);
  EXPECT_EQ(state(), ModuleState::kSafeStop);
}

TEST_F(OperatedModule, HoldIsRefusedByTheBus_BalancesAgainAndLetsGoLater) {
  const HandOver::Params params;
  ask(OperatorCommand::kArm, kInitialised_ticks);
  const double balance_nmprad = knee_kp_nmprad();
  ask(OperatorCommand::kHandOver, params.rest_ticks + 10);
  ASSERT_EQ(state(), ModuleState::kHandingOver);
  ASSERT_GT(knee_kp_nmprad(), balance_nmprad) << "the hold";
  joints_.writes.fail_next();
  stand(2);
  EXPECT_EQ(knee_kp_nmprad(), balance_nmprad);
  stand(params.rest_ticks);
  EXPECT_EQ(state(), ModuleState::kHandingOver);
  stand(params.hold_ticks);
  EXPECT_EQ(state(), ModuleState::kReleased);
}

TEST_F(OperatedModule, HandOverOfARobotThatDoesNotStand_IsRefused) {
  ask(OperatorCommand::kArm, kInitialised_ticks);
  foot_force_n_[1] = 0.0;
  stand(100);
  ask(OperatorCommand::kHandOver, 1);
  EXPECT_EQ(refusal(), Refusal::kFootLifted);
  EXPECT_EQ(state(), ModuleState::kStanding);
}

TEST_F(OperatedModule, StopWhileArmingWaits_IsOff) {
  joints_.told.feet_silent = true;
  ask(OperatorCommand::kArm, 20);
  EXPECT_EQ(state(), ModuleState::kArming);
  ask(OperatorCommand::kStop, 1);
  EXPECT_EQ(state(), ModuleState::kOff);
  joints_.told.feet_silent = false;
  stand(20);
  EXPECT_EQ(state(), ModuleState::kOff);
  EXPECT_EQ(knee_kp_nmprad(), 0.0);
}

}  // namespace
}  // namespace polygmap
