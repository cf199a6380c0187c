// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/joints/joint_reference.hpp"

#include <gtest/gtest.h>

#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

class JointReferenceTest : public testing::Test {
 protected:
  JointReferenceTest() {
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      base_T_sole_[index_of(leg)] = {Mat3::Identity(), Vec3{0, side_sign(leg) * kStanceHalfWidth_m, -0.75}};
      q_rad_.segment<6>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
          solve_leg({}, leg, base_T_sole_[index_of(leg)]).q_rad;
    }
    EXPECT_TRUE(reference_.try_arm(nominal_robot(), {}, q_rad_));
  }
  JointReference reference_;
  JointVector q_rad_;
  std::array<Transform, kFootCount> base_T_sole_;
  JointCommand command_;
};

TEST_F(JointReferenceTest, AnglesFartherOutsideThanAnEncoderMayBeOff_AreNamedAndNotArmed) {
  EXPECT_TRUE(JointReference::out_of_range(nominal_robot(), {}, q_rad_).is_empty());
  q_rad_[kKnee] = -0.019;
  EXPECT_TRUE(JointReference::out_of_range(nominal_robot(), {}, q_rad_).is_empty());
  q_rad_[kKnee] = -0.021;
  q_rad_[11] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(JointReference::out_of_range(nominal_robot(), {}, q_rad_).bits(), 1U << kKnee | 1U << 11U);
  JointReference other;
  EXPECT_FALSE(other.try_arm(nominal_robot(), {}, q_rad_));
}

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

TEST_F(JointReferenceTest, GainsBeyondTheRobotsLimits_AreNeverCommanded) {
  RobotModel robot = nominal_robot();
  robot.drives.kp_most_nmprad = {220, 100, 224, 224, 58, 58};
  robot.drives.kd_most_nmsprad = {5, 5, 5, 5, 2, 2};
  robot.drives.gain_limits[kKnee].kp_nmprad = 150.0;  // this one's frame says no more
  JointReference reference;
  ASSERT_TRUE(reference.try_arm(robot, {}, q_rad_));
  const auto expect_within = [&] {
    for (std::size_t n = 0; n < kJointCount; ++n) {
      EXPECT_EQ(command_.joints[n].kp_nmprad, n == kKnee ? 150.0 : robot.drives.kp_most_nmprad[n % kJointsPerLeg]);
      EXPECT_EQ(command_.joints[n].kd_nmsprad, robot.drives.kd_most_nmsprad[n % kJointsPerLeg]);
    }
  };
  reference.hold(command_);
  expect_within();
  (void)reference.follow(base_T_sole_, {true, false}, command_);
  expect_within();
  for (int i = 0; i < 100; ++i) reference.stiffen_blind(true, {true, true}, command_);
  expect_within();
}

TEST_F(JointReferenceTest, NobodyBalances_StandingLegsAloneBecomeStiffer_AndBackInAsManyTicks) {
  (void)reference_.follow(base_T_sole_, {true, false}, command_);
  const JointCommand balanced = command_;
  const auto ticks = static_cast<int>(JointReference::Params{}.blind_ramp_s / kTick_s + 0.5);
  double last_nmprad = balanced.joints[kAnklePitch].kp_nmprad;
  for (int i = 0; i < ticks; ++i) {
    command_ = balanced;
    reference_.stiffen_blind(true, {true, false}, command_);
    EXPECT_GT(command_.joints[kAnklePitch].kp_nmprad, last_nmprad);
    EXPECT_LT(command_.joints[kAnklePitch].kp_nmprad, last_nmprad + 10.0);
    last_nmprad = command_.joints[kAnklePitch].kp_nmprad;
  }
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    EXPECT_NEAR(command_.joints[j].kp_nmprad, nominal_robot().drives.kp_blind_nmprad[j], 1e-6);
    EXPECT_GT(command_.joints[j].kp_nmprad, balanced.joints[j].kp_nmprad);
    EXPECT_EQ(command_.joints[kJointsPerLeg + j].kp_nmprad, balanced.joints[kJointsPerLeg + j].kp_nmprad);
  }
  for (int i = 0; i < ticks; ++i) {
    command_ = balanced;
    reference_.stiffen_blind(false, {true, false}, command_);
  }
  EXPECT_EQ(command_.joints[kAnklePitch].kp_nmprad, balanced.joints[kAnklePitch].kp_nmprad);
}

// What the module adds to the torques of standing left and swinging right leg, whose joints all turn 0.1 rad/s too
// fast.
class JointDampingTest : public JointReferenceTest {
 protected:
  JointDampingTest() { feedback_.dq_radps.setConstant(0.1); }
  JointVector added_nm(const RobotModel& robot) {
    JointReference reference;
    EXPECT_TRUE(reference.try_arm(robot, {.swing_gain = 2.0}, q_rad_));
    (void)reference.follow(base_T_sole_, stands_, command_);  // where they are: at rest
    JointVector torque_nm = JointVector::Constant(7.0);
    reference.add_damping(stands_, feedback_, command_, torque_nm);
    return torque_nm - JointVector::Constant(7.0);
  }
  static RobotModel within(double kd_nmsprad) {
    RobotModel robot = nominal_robot();
    robot.drives.kd_nmsprad = {10, 10, 10, 10, 4, 4};
    for (GainLimits& limits : robot.drives.gain_limits) limits.kd_nmsprad = kd_nmsprad;
    return robot;
  }
  static constexpr std::size_t kRight = kJointsPerLeg;
  std::array<bool, kFootCount> stands_{true, false};
  JointFeedback feedback_;
};

TEST_F(JointDampingTest, DrivesWithRoomForAllOfIt_GetNoTorque) {
  EXPECT_TRUE(added_nm(nominal_robot()).isZero(0.0));
  EXPECT_TRUE(added_nm(within(20.0)).isZero(0.0));
}

TEST_F(JointDampingTest, DriveWithoutRoom_GetsTheRestAsTorque) {
  const JointVector nm = added_nm(within(5.0));
  EXPECT_NEAR(nm[kKnee], -0.1 * (10.0 - 5.0), 1e-9);
  EXPECT_EQ(nm[kAnklePitch], 0.0);
  EXPECT_NEAR(nm[kRight + kAnklePitch], -0.1 * (8.0 - 5.0), 1e-9);
}

TEST_F(JointDampingTest, DriveThatHasLessThanHalf_GetsNoMoreThanItsOwn) {
  EXPECT_NEAR(added_nm(within(5.0))[kRight + kKnee], -0.1 * 5.0, 1e-9);  // of 20 in the swing
  EXPECT_NEAR(added_nm(within(3.0))[kKnee], -0.1 * 3.0, 1e-9);
  EXPECT_TRUE(added_nm(within(0.0)).isZero(0.0));
}

TEST_F(JointDampingTest, LessDampingAskedForByTheParameters_AddsNone) {
  RobotModel robot = within(5.0);
  robot.drives.kd_most_nmsprad = {5, 5, 5, 5, 2, 2};
  EXPECT_TRUE(added_nm(robot).isZero(0.0));
}

TEST_F(JointDampingTest, DriveThatMissedACycle_GetsNone) {
  feedback_.silent_cycles[kKnee] = 1;
  const JointVector nm = added_nm(within(5.0));
  EXPECT_EQ(nm[kKnee], 0.0);
  EXPECT_LT(nm[kHipPitch], 0.0);
}

// A whole bus that is silent leaves the last sample there, of a foot that just touched down, say.
TEST_F(JointDampingTest, SpeedsOfLongAgo_DampNothing) {
  command_.stamp_ns = JointReference::Params{}.damping_age_ns;
  EXPECT_LT(added_nm(within(5.0))[kKnee], 0.0);
  command_.stamp_ns += 2 * kNsPerMs;
  EXPECT_TRUE(added_nm(within(5.0)).isZero(0.0));
}

}  // namespace
}  // namespace polygmap
