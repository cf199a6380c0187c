// SPDX-License-Identifier: Apache-2.0
// From the first cycle to the first estimate: what the drives get no gains without, and that whatever fails once they
// have them ends in a safe stop with its name.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tests/support/standing_module.hpp"

namespace polygmap {
namespace {

using test::StandingModule;

// An MIT drive answers only a command.
TEST_F(StandingModule, BeforeAllDrivesAnswered_CommandsHaveNoGainsAndNothingElseBegins) {
  const auto expect_arming = [&] {
    EXPECT_EQ(control().module_state(), ModuleState::kArming);
    ASSERT_FALSE(joints_.commands().empty());
    const JointCommand& command = joints_.commands().newest();
    EXPECT_EQ(command.stamp_ns, clock_.now_ns());
    for (const JointSetpoint& joint : command.joints) {
      EXPECT_EQ(joint.kp_nmprad, 0.0);
      EXPECT_EQ(joint.kd_nmsprad, 0.0);
      EXPECT_EQ(joint.tau_ff_nm, 0.0);
    }
  };
  const ImuSample imu = imu_at(clock_.now_ns() + kCycle_ns);
  clock_.advance_ns(kCycle_ns);
  tick_with(&imu, nullptr);
  expect_arming();
  EXPECT_EQ(count(Fault::kJointFeedbackMissing), 0U) << "nobody was asked yet";
  for (int i = 0; i < 20; ++i) {
    clock_.advance_ns(kCycle_ns);
    JointFeedback joints = joints_at(clock_.now_ns());
    joints.silent_cycles[11] = JointFeedback::kNeverHeard;
    joints.q_rad[11] = 0.0;
    tick_with(&imu, &joints);
    expect_arming();
  }
  EXPECT_EQ(count(Fault::kJointFeedbackRejected), 0U);
  EXPECT_EQ(count(Fault::kDriveSilent), 0U);
  stand(1);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_GT(joints_.commands().newest().joints[11].kp_nmprad, 0.0) << "the robot's own gains";
}

class ArmingTest : public StandingModule {
 protected:
  // Until half a second after the first cycle nothing is named, from then on it is, once; the module asks on.
  template <class FeedbackAt>
  void arm(Fault fault, std::uint32_t times, FeedbackAt feedback_at) {
    for (int i = 0; i < 400; ++i) {
      clock_.advance_ns(kCycle_ns);
      const ImuSample imu = imu_at(clock_.now_ns());
      const std::optional<JointFeedback> joints = feedback_at(clock_.now_ns());
      tick_with(&imu, joints ? &*joints : nullptr);
      ASSERT_EQ(count(fault), i < 250 ? 0U : times) << i;
      ASSERT_EQ(control().module_state(), ModuleState::kArming);
      ASSERT_EQ(joints_.commands().newest().stamp_ns, clock_.now_ns());
      ASSERT_EQ(joints_.commands().newest().joints[3].kp_nmprad, 0.0);
    }
  }
};

TEST_F(ArmingTest, OneDriveNeverAnswers_IsNamedAfterHalfASecondAndTakenInWhenItDoes) {
  ASSERT_NO_FATAL_FAILURE(arm(Fault::kDriveSilent, 1, [this](std::int64_t now_ns) {
    JointFeedback joints = joints_at(now_ns);
    joints.silent_cycles[11] = JointFeedback::kNeverHeard;
    return std::optional(joints);
  }));
  EXPECT_EQ(control().drives().silent.bits(), 1U << 11U);
  EXPECT_EQ(count(Fault::kJointFeedbackMissing), 0U);
  stand(1);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_TRUE(control().drives().silent.is_empty());
  EXPECT_EQ(control().drives().ever_silent.bits(), 1U << 11U);
  stand(100);
  EXPECT_EQ(count(Fault::kDriveSilent), 1U);
}

TEST_F(ArmingTest, NoDriveEverAnswers_AllAreNamed) {
  ASSERT_NO_FATAL_FAILURE(
      arm(Fault::kDriveSilent, kJointCount, [](std::int64_t) { return std::optional<JointFeedback>(); }));
  EXPECT_TRUE(control().drives().silent.is_all());
  stand(1);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_TRUE(control().drives().silent.is_empty());
}

TEST_F(ArmingTest, FeetNeverAnswer_AreNamedAfterHalfASecondAndTakenInWhenTheyDo) {
  joints_.told.feet_silent = true;
  ASSERT_NO_FATAL_FAILURE(arm(Fault::kFeetSilent, 1, [this](std::int64_t now_ns) {
    JointFeedback joints = joints_at(now_ns);
    joints.foot_force_n.fill(std::numeric_limits<double>::quiet_NaN());
    return std::optional(joints);
  }));
  EXPECT_EQ(count(Fault::kDriveSilent), 0U);
  joints_.told.feet_silent = false;
  stand(10);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_EQ(count(Fault::kFeetSilent), 1U);
}

// An answer of long ago is none.
TEST_F(ArmingTest, DriveAnsweredOnceAndIsSilentSince_IsNamedAndHoldsTheGainsBack) {
  std::uint16_t silent = 0;
  ASSERT_NO_FATAL_FAILURE(arm(Fault::kDriveSilent, 2, [&](std::int64_t now_ns) {
    JointFeedback joints = joints_at(now_ns);
    joints.silent_cycles[7] = silent++;
    joints.silent_cycles[11] = JointFeedback::kNeverHeard;
    return std::optional(joints);
  }));
  for (int i = 0; i < 50; ++i) {  // the other one comes
    clock_.advance_ns(kCycle_ns);
    const ImuSample imu = imu_at(clock_.now_ns());
    JointFeedback joints = joints_at(clock_.now_ns());
    joints.silent_cycles[7] = silent++;
    tick_with(&imu, &joints);
  }
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(joints_.commands().newest().joints[3].kp_nmprad, 0.0);
  EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kAnswers, JointSet::of_bits(1U << 7U)}));
  stand(1);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_TRUE(control().drives().silent.is_empty());
}

TEST_F(ArmingTest, AllDrivesFallSilent_AreNamed) {
  int cycle = 0;
  ASSERT_NO_FATAL_FAILURE(arm(Fault::kDriveSilent, kJointCount, [&](std::int64_t now_ns) {
    JointFeedback joints = joints_at(now_ns);
    joints.silent_cycles[11] = JointFeedback::kNeverHeard;
    return ++cycle < 200 ? std::optional(joints) : std::nullopt;
  }));
  EXPECT_TRUE(control().arming_waits_for().joints.is_all());
}

// An error that was there at power-up is cleared by the bus: it ends no climb.
TEST_F(ArmingTest, DriveTellsAnError_HoldsTheGainsBackUntilItIsGone) {
  joints_.told.drive_errors.insert(4);
  joints_.told.drive_error_replies = 1;
  stand(50);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(joints_.commands().newest().joints[3].kp_nmprad, 0.0);
  EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kErrors, JointSet::of_bits(1U << 4U)}));
  EXPECT_EQ(count(Fault::kDriveError), 1U);
  joints_.told.drive_errors = {};
  stand(kInitialised_ticks);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_TRUE(control().state().initialised);
  EXPECT_EQ(control().arming_waits_for(), ArmingWait{});
}

TEST_F(ArmingTest, DriveIsTooHot_HoldsTheGainsBackUntilItHasCooled) {
  joints_.told.drive_degc[4] = 95;
  stand(50);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(joints_.commands().newest().joints[3].kp_nmprad, 0.0);
  EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kCooler, JointSet::of_bits(1U << 4U)}));
  EXPECT_EQ(count(Fault::kDriveHot), 1U);
  joints_.told.drive_degc[4] = 60;
  stand(kInitialised_ticks);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_EQ(control().arming_waits_for(), ArmingWait{});
}

TEST_F(ArmingTest, JointBeyondItsRange_IsNamedAndHoldsTheGainsBackUntilItIsInside) {
  const auto stand_with_knee = [this](double knee_rad, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      clock_.advance_ns(kCycle_ns);
      const ImuSample imu = imu_at(clock_.now_ns());
      JointFeedback joints = joints_at(clock_.now_ns());
      joints.q_rad.setZero();  // straight legs: the soles are parallel
      joints.q_rad[kKnee] = knee_rad;
      tick_with(&imu, &joints);
    }
  };
  for (const double knee_rad : {-0.03, std::numeric_limits<double>::quiet_NaN()}) {
    stand_with_knee(knee_rad, 300);
    EXPECT_EQ(control().module_state(), ModuleState::kArming);
    EXPECT_EQ(joints_.commands().newest().joints[kKnee].kp_nmprad, 0.0);
    EXPECT_EQ(control().drives().out_of_range.bits(), 1U << kKnee);
    EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kRange, JointSet::of_bits(1U << kKnee)}));
    EXPECT_EQ(count(Fault::kJointOutOfRange), 1U);
  }
  stand_with_knee(-0.01, 1);  // within what an encoder may be off
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_GT(joints_.commands().newest().joints[kKnee].kp_nmprad, 0.0);
  EXPECT_TRUE(control().drives().out_of_range.is_empty());
}

TEST_F(ArmingTest, ImuSilent_HoldsTheGainsBackUntilItSpeaks) {
  clock_.advance_ns(kCycle_ns);
  const ImuSample once = imu_at(clock_.now_ns());  // before the drives answer, and no more
  tick_with(&once, nullptr);
  clock_.advance_ns(50 * kNsPerMs);
  for (int i = 0; i < 300; ++i) {
    clock_.advance_ns(kCycle_ns);
    const JointFeedback joints = joints_at(clock_.now_ns());
    tick_with(nullptr, &joints);
    ASSERT_EQ(control().module_state(), ModuleState::kArming);
    ASSERT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kImu, {}}));
  }
  EXPECT_EQ(joints_.commands().newest().joints[3].kp_nmprad, 0.0);
  EXPECT_GT(count(Fault::kImuMissing), 200U);
  stand(1);
  EXPECT_TRUE(is_running(control().module_state()));
}

// Turned by 13 deg, on its side and upside down.
TEST_F(ArmingTest, ImuIsTurned_IsNamedAndHoldsTheGainsBackUntilItIsNot) {
  std::uint32_t named = 0;
  for (const double turn_rad : {13.0 * kPi / 180.0, 0.5 * kPi, kPi}) {
    const auto lean_deg = static_cast<std::uint16_t>(std::lround(turn_rad * 180.0 / kPi));
    for (int i = 0; i < 600; ++i) {
      clock_.advance_ns(kCycle_ns);
      ImuSample imu = imu_at(clock_.now_ns());
      imu.accel_mps2 = rotation_y(turn_rad) * imu.accel_mps2;
      const JointFeedback joints = joints_at(clock_.now_ns());
      tick_with(&imu, &joints);
      ASSERT_EQ(control().module_state(), ModuleState::kArming);
      ASSERT_EQ(joints_.commands().newest().joints[3].kp_nmprad, 0.0);
    }
    EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kGravity, {}, lean_deg}));
    named = std::max(named, count(Fault::kGravityDisagrees));
    EXPECT_EQ(named, 1U) << "it disagrees all the while";
  }
  EXPECT_EQ(count(Fault::kSolesDisagree), 0U);
  stand(600);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_EQ(control().arming_waits_for(), ArmingWait{});
  EXPECT_EQ(count(Fault::kGravityDisagrees), 1U);
}

// In units of g, with an axis that is dead, and all of them.
TEST_F(ArmingTest, ImuFeelsAnotherGravity_IsNamedAndHoldsTheGainsBack) {
  for (const double share : {1.0 / kGravity_mps2, 0.0, 0.9, 1.1}) {
    for (int i = 0; i < 300; ++i) {
      clock_.advance_ns(kCycle_ns);
      ImuSample imu = imu_at(clock_.now_ns());
      imu.accel_mps2 *= share;
      const JointFeedback joints = joints_at(clock_.now_ns());
      tick_with(&imu, &joints);
      ASSERT_EQ(control().module_state(), ModuleState::kArming) << share;
    }
    EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kStrength, {}})) << share;
    EXPECT_EQ(count(Fault::kGravityDisagrees), 1U);
  }
  stand(1);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_F(ArmingTest, EncoderOfOneLegIsWrong_IsNamedAndHoldsTheGainsBackUntilItIsNot) {
  const auto stand_with_ankle = [this](double off_rad, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      clock_.advance_ns(kCycle_ns);
      const ImuSample imu = imu_at(clock_.now_ns());
      JointFeedback joints = joints_at(clock_.now_ns());
      joints.q_rad[kAnklePitch] += off_rad;
      tick_with(&imu, &joints);
    }
  };
  stand_with_ankle(0.2, 240);
  EXPECT_EQ(count(Fault::kSolesDisagree), 0U) << "it is named after half a second";
  stand_with_ankle(0.2, 60);
  EXPECT_EQ(count(Fault::kSolesDisagree), 1U);
  EXPECT_EQ(count(Fault::kGravityDisagrees), 0U);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(joints_.commands().newest().joints[kKnee].kp_nmprad, 0.0);
  EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kSoles, {}, 11}));
  stand_with_ankle(0.05, 1);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_F(ArmingTest, AskedToStop_ArmsNoMore) {
  module_.pipeline().control().request_stop();
  stand(100);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(joints_.commands().newest().joints[3].kp_nmprad, 0.0);
}

// The drives have gains, and the robot has not stood still for long enough to know where it is.
class BeforeTheEstimate : public StandingModule {
 protected:
  void SetUp() override {
    stand(50);
    ASSERT_TRUE(is_running(control().module_state()));
    ASSERT_FALSE(control().state().initialised);
  }
  void stand_without(bool imu, bool joints, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      clock_.advance_ns(kCycle_ns);
      const ImuSample sample = imu_at(clock_.now_ns());
      const JointFeedback feedback = joints_at(clock_.now_ns());
      tick_with(imu ? nullptr : &sample, joints ? nullptr : &feedback);
    }
  }
  // For good, on the gains it has: an estimate that comes later starts nothing.
  void expect_safe_stop(StopReason reason) {
    ASSERT_EQ(control().module_state(), ModuleState::kSafeStop);
    EXPECT_EQ(control().gait_status().stop_reason, reason);
    EXPECT_EQ(count(Fault::kGaitStopped), 1U);
    const JointCommand held = control().last_command();
    stand(kInitialised_ticks + 100);
    EXPECT_TRUE(control().state().initialised);
    EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
    EXPECT_EQ(control().gait_status().stop_reason, reason);
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const JointSetpoint& joint = joints_.commands().newest().joints[n];
      EXPECT_GT(joint.kp_nmprad, 0.0) << n;
      EXPECT_NEAR(joint.q_rad, held.joints[n].q_rad, 1e-3) << n;  // encoder offsets are learnt
    }
  }
};

TEST_F(BeforeTheEstimate, ImuFallsSilent_StopsWithinATenthOfASecond) {
  stand_without(true, false, 45);
  EXPECT_TRUE(is_running(control().module_state()));
  stand_without(true, false, 10);
  EXPECT_EQ(count(Fault::kStateStale), 1U);
  expect_safe_stop(StopReason::kStateStale);
}

TEST_F(BeforeTheEstimate, JointsFallSilent_StopsWithinATenthOfASecond) {
  stand_without(false, true, 55);
  EXPECT_EQ(count(Fault::kStateStale), 1U);
  expect_safe_stop(StopReason::kStateStale);
}

TEST_F(BeforeTheEstimate, BothSilentForAMoment_GoesOn) {
  stand_without(true, true, 45);
  stand(kInitialised_ticks);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_TRUE(control().state().initialised);
}

TEST_F(BeforeTheEstimate, DriveTellsAnError_Stops) {
  joints_.told.drive_errors.insert(4);
  stand(2);
  expect_safe_stop(StopReason::kDriveError);
}

TEST_F(BeforeTheEstimate, BusRefusesForFiftyMilliseconds_Stops) {
  for (std::uint32_t i = 0; i < OverloadGuard::Params{}.most_refused; ++i) {
    joints_.writes.fail_next();
    stand(1);
  }
  EXPECT_EQ(control().module_state(), ModuleState::kStopping);
  stand(2);
  expect_safe_stop(StopReason::kCommandsRefused);
}

TEST_F(BeforeTheEstimate, EveryTickComesTwoCyclesLate_Stops) {
  for (int i = 0; i < 30 && count(Fault::kTimeShort) == 0; ++i) {
    clock_.advance_ns(2 * kCycle_ns);
    stand(1);
  }
  EXPECT_EQ(count(Fault::kTimeShort), 1U);
  stand(2);
  expect_safe_stop(StopReason::kTimeShort);
}

TEST_F(BeforeTheEstimate, AskedToStop_Stops) {
  module_.pipeline().control().request_stop();
  stand(1);
  expect_safe_stop(StopReason::kOperator);
}

class PipelineWithBadStiffness : public StandingModule {
 protected:
  PipelineWithBadStiffness() : StandingModule(params()) {}
  static Params params() {
    Params params;
    params.robot.drives.kp_nmprad[0] = std::numeric_limits<double>::quiet_NaN();
    return params;
  }
};

TEST_F(PipelineWithBadStiffness, CommandNotFinite_IsCountedAndNeverSent) {
  stand(10);
  EXPECT_EQ(count(Fault::kJointCommandInvalid), 10U);
  EXPECT_EQ(joints_.writes.calls(), 0U);
}

// The drives keep what they were told last, as when the bus refuses.
TEST_F(PipelineWithBadStiffness, CommandsNotFiniteForFiftyMilliseconds_StopsAndSaysSo) {
  stand(OverloadGuard::Params{}.most_refused - 1);
  EXPECT_TRUE(is_running(control().module_state()));
  stand(1);
  EXPECT_EQ(control().module_state(), ModuleState::kStopping);
  EXPECT_EQ(count(Fault::kCommandsRefused), 1U);
  EXPECT_EQ(count(Fault::kJointCommandRefused), 0U) << "the bus was asked nothing";
  stand(1);
  EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kCommandsRefused);
  EXPECT_EQ(joints_.writes.calls(), 0U);
}

}  // namespace
}  // namespace polygmap
