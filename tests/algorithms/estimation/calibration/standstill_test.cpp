// SPDX-License-Identifier: Apache-2.0
// Biases and gravity at the start, of a robot that does not quite stand still.
#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/estimation/estimator.hpp"
#include "algorithms/geometry/so3.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_s;

// On soft drives a robot that stands sways about its ankles: here as seed 50 did under physics, with 36 mrad/s and less
// and less.
struct SwayingRobot {
  static constexpr double kRate_radps = 9.7, kFade_ps = 0.6, kSway_rad = 0.0037, kLean_rad = -0.03, kHeight_m = 0.75;
  Vec3 gyro_bias_radps{1e-3, -2e-3, 3e-3};
  double unseen_radps = 0.0;  // in the first second the base leans on by this within the joints' play
  double time_s = 0.0;

  [[nodiscard]] double unseen_rad(double t_s) const { return unseen_radps * std::min(t_s, 1.0); }
  [[nodiscard]] static double pitch_rad(double t_s) {
    return kLean_rad + kSway_rad * std::exp(-kFade_ps * t_s) * std::sin(kRate_radps * t_s + 0.7);
  }
  [[nodiscard]] static Transform true_T_base(double t_s) {
    const Mat3 R = rotation_y(pitch_rad(t_s));
    return {R, R * Vec3{0.0, 0.0, kHeight_m}};
  }
  [[nodiscard]] static JointVector q_rad(double t_s) {
    JointVector q;
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      const Transform true_T_sole{Mat3::Identity(), Vec3{0.0, side_sign(leg) * kStanceHalfWidth_m, 0.0}};
      q.segment<6>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
          solve_leg({}, leg, true_T_base(t_s).inverse() * true_T_sole).q_rad;
    }
    return q;
  }
  // The next tick's.
  void sense(ImuSample& imu, JointFeedback& joints) {
    time_s += kTick_s;
    imu.stamp_ns = joints.stamp_ns = std::llround(time_s * 1e9);
    const auto p_m = [&](double t_s) { return true_T_base(t_s).p_m; };
    const Vec3 a_mps2 = (p_m(time_s + kTick_s) - 2.0 * p_m(time_s) + p_m(time_s - kTick_s)) / math::square(kTick_s);
    const Mat3 true_R_base = true_T_base(time_s).R * rotation_y(unseen_rad(time_s));
    imu.accel_mps2 = true_R_base.transpose() * (a_mps2 + Vec3{0.0, 0.0, kGravity_mps2});
    const auto felt_rad = [&](double t_s) { return pitch_rad(t_s) + unseen_rad(t_s); };
    imu.gyro_radps =
        gyro_bias_radps + Vec3{0.0, (felt_rad(time_s + kTick_s) - felt_rad(time_s - kTick_s)) / (2.0 * kTick_s), 0.0};
    joints.q_rad = q_rad(time_s);
    joints.dq_radps = (q_rad(time_s + kTick_s) - q_rad(time_s - kTick_s)) / (2.0 * kTick_s);
    joints.foot_force_n = {270.0, 270.0};
  }
};

TEST(Standstill, RobotSways_IsNoBiasAndNoTilt) {
  static Estimator estimator;  // its ring is too large for a stack
  estimator.reset({}, nominal_robot());
  SwayingRobot robot;
  ImuSample imu;
  JointFeedback joints;
  while (!estimator.state().initialised && robot.time_s < 3.0) {
    robot.sense(imu, joints);
    estimator.add_imu(imu, imu.stamp_ns);
    estimator.add_joints(joints, imu.stamp_ns);
    estimator.tick({true, true});
  }
  const StateEstimate& state = estimator.state();
  ASSERT_TRUE(state.initialised);
  EXPECT_EQ(estimator.counters().standstill_restarts, 0U);
  EXPECT_LT((estimator.odometry().filter().gyro_bias_radps() - robot.gyro_bias_radps).norm(), 1e-4);
  EXPECT_LT(so3_log(state.odom_T_base.R.transpose() * SwayingRobot::true_T_base(robot.time_s).R).norm(), 2e-4);
  const auto p_m = [](double t_s) { return SwayingRobot::true_T_base(t_s).p_m; };
  const Vec3 v_mps = (p_m(robot.time_s) - p_m(robot.time_s - kTick_s)) / kTick_s;
  EXPECT_GT(v_mps.norm(), 5e-3);
  EXPECT_LT((state.odom_v_base_mps - v_mps).norm(), 1e-3);
}

// Encoders sit before the joints' play: what the base leans by within it is taken for the gyro's bias. That must not
// turn the base on and on (seed 54 of reality 2: 25 mrad, and feet 38 mm behind their treads).
TEST(Standstill, RobotLeansWithinTheJointsPlay_TiltDoesNotRunAway) {
  static Estimator estimator;  // its ring is too large for a stack
  estimator.reset({}, nominal_robot());
  SwayingRobot robot;
  robot.unseen_radps = 0.005;
  ImuSample imu;
  JointFeedback joints;
  const auto tilt_error_rad = [&] {
    const Mat3 true_R_base = SwayingRobot::true_T_base(robot.time_s).R * rotation_y(robot.unseen_rad(robot.time_s));
    return so3_log(estimator.state().odom_T_base.R.transpose() * true_R_base).norm();
  };
  double bias_error_radps = 0.0, worst_rad = 0.0;
  while (robot.time_s < 8.0) {
    const bool before = estimator.state().initialised;
    robot.sense(imu, joints);
    estimator.add_imu(imu, imu.stamp_ns);
    estimator.add_joints(joints, imu.stamp_ns);
    estimator.tick({true, true});
    if (!before && estimator.state().initialised) {
      bias_error_radps = (estimator.odometry().filter().gyro_bias_radps() - robot.gyro_bias_radps).norm();
    }
    if (robot.time_s > 3.0) worst_rad = std::max(worst_rad, tilt_error_rad());
  }
  EXPECT_GT(bias_error_radps, 0.003) << "it was not deceived";
  EXPECT_LT(worst_rad, 0.004);
}

// It can be balanced from its first samples on, long before the calibration is over.
TEST(BeforeTheStandstill, RobotSways_TiltAndVelocityAreKnownAtOnce) {
  static Estimator estimator;  // its ring is too large for a stack
  estimator.reset({}, nominal_robot());
  SwayingRobot robot;
  ImuSample imu;
  JointFeedback joints;
  double worst_rad = 0.0, worst_mps = 0.0, late_rad = 0.0, late_mps = 0.0;
  while (robot.time_s < 0.9) {
    robot.sense(imu, joints);
    estimator.add_imu(imu, imu.stamp_ns);
    estimator.add_joints(joints, imu.stamp_ns);
    estimator.tick({true, true});
    const StateEstimate& state = estimator.state();
    ASSERT_FALSE(state.initialised);
    ASSERT_EQ(state.oldest_input_ns, imu.stamp_ns);
    const auto p_m = [](double t_s) { return SwayingRobot::true_T_base(t_s).p_m; };
    const Vec3 v_mps = (p_m(robot.time_s) - p_m(robot.time_s - kTick_s)) / kTick_s;
    const double off_rad = so3_log(state.odom_T_base.R.transpose() * SwayingRobot::true_T_base(robot.time_s).R).norm();
    const double off_mps = (state.odom_v_base_mps - v_mps).norm();
    worst_rad = std::max(worst_rad, off_rad), worst_mps = std::max(worst_mps, off_mps);
    if (robot.time_s > 0.5) late_rad = std::max(late_rad, off_rad), late_mps = std::max(late_mps, off_mps);
  }
  EXPECT_LT(worst_rad, 0.03) << "what it sways with is taken for tilt";
  EXPECT_LT(worst_mps, 0.012);  // 3 mm of the capture point
  EXPECT_LT(late_rad, 0.001);
  EXPECT_LT(late_mps, 0.0015);
}

TEST(Standstill, FootForceIsNotTold_IsNoFootThatStands) {
  static Estimator estimator;  // its ring is too large for a stack
  for (const std::array<bool, kFootCount> silent : {std::array{true, true}, {true, false}, {false, true}}) {
    estimator.reset({}, nominal_robot());
    SwayingRobot robot;
    ImuSample imu;
    JointFeedback joints;
    while (robot.time_s < 3.0) {
      robot.sense(imu, joints);
      for (std::size_t i = 0; i < kFootCount; ++i) {
        if (silent[i] && robot.time_s > 0.5) joints.foot_force_n[i] = test::kNaN;
      }
      estimator.add_imu(imu, imu.stamp_ns);
      estimator.add_joints(joints, imu.stamp_ns);
      estimator.tick({true, true});
    }
    EXPECT_FALSE(estimator.state().initialised) << silent[0] << silent[1];
    EXPECT_EQ(estimator.counters().standstill_restarts, 1U);
  }
}

}  // namespace
}  // namespace polygmap
