// SPDX-License-Identifier: Apache-2.0
#include "algorithms/robot/drive_torque.hpp"

#include <gtest/gtest.h>

#include <random>

namespace polygmap {
namespace {

// 100 Nm up to 4 rad/s, none at 8: 25 Nm less for each rad/s.
constexpr JointLimits kDrive{-3.0, 3.0, 6.0, 100.0, 4.0, 8.0};

TEST(TorqueAvailable, UpToTheCorner_IsAllTorque) {
  EXPECT_EQ(torque_available_nm(kDrive, 0.0), 100.0);
  EXPECT_EQ(torque_available_nm(kDrive, 4.0), 100.0);
  EXPECT_EQ(torque_available_nm(kDrive, -4.0), 100.0);
}

TEST(TorqueAvailable, BeyondTheCorner_FallsLinearlyToNone) {
  EXPECT_DOUBLE_EQ(torque_available_nm(kDrive, 5.0), 75.0);
  EXPECT_DOUBLE_EQ(torque_available_nm(kDrive, -6.0), 50.0);
  EXPECT_NEAR(torque_available_nm(kDrive, 7.6), 10.0, 1e-12);
  EXPECT_EQ(torque_available_nm(kDrive, 8.0), 0.0);
  EXPECT_EQ(torque_available_nm(kDrive, -20.0), 0.0);
}

TEST(TorqueAvailable, CornerAtTheNoLoadSpeed_IsAllOrNone) {
  constexpr JointLimits kSquare{-3.0, 3.0, 6.0, 100.0, 6.0, 6.0};
  EXPECT_EQ(torque_available_nm(kSquare, 6.0), 100.0);
  EXPECT_EQ(torque_available_nm(kSquare, 6.001), 0.0);
}

TEST(TorqueRange, WhatBrakes_IsAllThereAtAnySpeed) {
  const TorqueRange ahead = torque_range_nm(kDrive, 7.0);
  EXPECT_EQ(ahead.least_nm, -100.0);
  EXPECT_DOUBLE_EQ(ahead.most_nm, 25.0);
  const TorqueRange back = torque_range_nm(kDrive, -7.0);
  EXPECT_DOUBLE_EQ(back.least_nm, -25.0);
  EXPECT_EQ(back.most_nm, 100.0);
}

TEST(LimitTorque, SetpointWithinTheLine_StaysBitForBit) {
  JointSetpoint joint{0.3, 1.0, 20.0, 100.0, 5.0};
  limit_torque(kDrive, 0.1, 1.0, joint);  // 20 + 100 * 0.2 + 5 * 0 = 40 Nm
  EXPECT_EQ(joint.tau_ff_nm, 20.0);
  EXPECT_EQ(joint.kp_nmprad, 100.0);
  EXPECT_EQ(joint.kd_nmsprad, 5.0);
}

TEST(LimitTorque, GainsAndFeedForwardBeyondTheLine_FeedForwardMakesRoom) {
  JointSetpoint joint{0.3, 6.0, 40.0, 100.0, 5.0};
  limit_torque(kDrive, 0.1, 6.0, joint);  // 40 + 20 Nm asked, 50 there
  EXPECT_DOUBLE_EQ(joint.tau_ff_nm, 30.0);
  EXPECT_EQ(joint.kp_nmprad, 100.0);
  EXPECT_DOUBLE_EQ(torque_asked_nm(joint, 0.1, 6.0), 50.0);
}

TEST(LimitTorque, BeyondTheNoLoadSpeed_DrivesNothingAndBrakes) {
  JointSetpoint driving{0.0, 9.0, 40.0, 0.0, 5.0};
  limit_torque(kDrive, 0.0, 9.0, driving);
  EXPECT_EQ(driving.tau_ff_nm, 0.0);
  JointSetpoint braking{0.0, 0.0, -40.0, 0.0, 5.0};
  limit_torque(kDrive, 0.0, 9.0, braking);  // -40 - 45 Nm
  EXPECT_EQ(braking.tau_ff_nm, -40.0);
}

TEST(LimitTorque, GainsBeyondTwiceTheTorque_AreLowered) {
  JointSetpoint joint{1.0, 6.0, 0.0, 300.0, 10.0};
  limit_torque(kDrive, 0.0, 6.0, joint);  // 300 Nm of stiffness: 50 there and 100 of feed-forward leave 150 of them
  EXPECT_EQ(joint.tau_ff_nm, -100.0);
  EXPECT_DOUBLE_EQ(joint.kp_nmprad, 150.0);
  EXPECT_DOUBLE_EQ(joint.kd_nmsprad, 5.0);
}

TEST(LimitTorque, SlowJoint_IsLeftToItsDrive) {
  JointSetpoint joint{1.0, 0.0, 50.0, 400.0, 10.0};
  limit_torque(kDrive, 0.0, 4.0, joint);
  EXPECT_EQ(joint.tau_ff_nm, 50.0);
  EXPECT_EQ(joint.kp_nmprad, 400.0);
}

TEST(LimitTorque, AnySetpointBeyondTheCorner_AsksForNoMoreThanThereIs) {
  std::mt19937 random(1);
  const auto within = [&](double most) { return std::uniform_real_distribution<>(-most, most)(random); };
  for (int i = 0; i < 100000; ++i) {
    const JointSetpoint before{within(3.0), within(6.0), within(100.0), std::abs(within(800.0)),
                               std::abs(within(20.0))};
    const double q_rad = within(3.0), dq_radps = within(10.0);
    if (std::abs(dq_radps) <= kDrive.corner_radps) continue;
    JointSetpoint joint = before;
    limit_torque(kDrive, q_rad, dq_radps, joint);
    constexpr double kRounding = 1e-9;
    const TorqueRange range = torque_range_nm(kDrive, dq_radps);
    const double asked_nm = torque_asked_nm(joint, q_rad, dq_radps);
    ASSERT_GE(asked_nm, range.least_nm - kRounding);
    ASSERT_LE(asked_nm, range.most_nm + kRounding);
    ASSERT_LE(std::abs(joint.tau_ff_nm), kDrive.torque_nm);
    ASSERT_GE(joint.kp_nmprad, 0.0);
    ASSERT_LE(joint.kp_nmprad, before.kp_nmprad);
    ASSERT_LE(joint.kd_nmsprad, before.kd_nmsprad);
    ASSERT_EQ(joint.q_rad, before.q_rad);
  }
}

}  // namespace
}  // namespace polygmap
