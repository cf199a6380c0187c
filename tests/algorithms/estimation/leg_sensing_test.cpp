// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/leg_sensing.hpp"

#include <gtest/gtest.h>

#include "algorithms/robot/drive_torque.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/standing_torques.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_ns;

constexpr double kTold = 1.2;  // by the drives, over what the legs need

// Stands upright on both feet for `ticks`, without sensors of their forces.
void stand(LegSensing& sensing, int ticks) {
  const Vec3 up = Vec3::UnitZ();
  JointFeedback joints = test::standing_on_both(up, 0.5);
  joints.foot_force_n.fill(test::kNaN);
  joints.tau_nm *= kTold;
  ImuSample base;
  base.accel_mps2 = kGravity_mps2 * up;
  for (int i = 0; i < ticks; ++i) {
    joints.stamp_ns += kTick_ns;
    ASSERT_TRUE(sensing.try_take(joints, joints.stamp_ns, base, up, {true, true}));
  }
}

TEST(LegSensing, DrivesOfTooLittleTorque_AreReadAndAskedInTheLegsTorques) {
  const RobotModel robot = nominal_robot();
  LegSensing sensing;
  sensing.reset({}, robot);
  stand(sensing, 1000);
  EXPECT_NEAR(sensing.torque_scale(), kTold, 0.05 * kTold) << "of which the damping of the observed force takes most";

  JointCommand command;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    command.joints[n].tau_ff_nm = sensing.joints().tau_nm[static_cast<Eigen::Index>(n)];
  }
  command.joints[kKnee].tau_ff_nm = robot.drives.limits[kKnee].torque_nm;
  const double asked_nm = command.joints[kAnklePitch].tau_ff_nm;
  sensing.to_drives(command);
  EXPECT_DOUBLE_EQ(command.joints[kAnklePitch].tau_ff_nm, sensing.torque_scale() * asked_nm);
  EXPECT_DOUBLE_EQ(command.joints[kKnee].tau_ff_nm, robot.drives.limits[kKnee].torque_nm) << "never more than it has";
}

// The knee turns by 6 rad/s, beyond its corner, and its command leads it by so much that it asks for more.
TEST(LegSensing, CommandBeyondTheDrivesLine_AsksForWhatTheDriveHasAtItsSpeed) {
  const RobotModel robot = nominal_robot();
  LegSensing sensing;
  sensing.reset({}, robot);
  stand(sensing, 1);
  const JointFeedback& joints = sensing.joints();
  const JointLimits& limits = robot.drives.limits[kKnee];
  const auto asked_nm = [&](double dq_radps, std::int64_t late_ns) {
    LegSensing moving;
    moving.reset({}, robot);
    JointFeedback feedback = joints;
    feedback.dq_radps[kKnee] = dq_radps;
    ImuSample base;
    base.accel_mps2 = {0, 0, kGravity_mps2};
    EXPECT_TRUE(moving.try_take(feedback, feedback.stamp_ns, base, Vec3::UnitZ(), {true, true}));
    JointCommand command;
    command.stamp_ns = feedback.stamp_ns + late_ns;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      command.joints[n] = {feedback.q_rad[static_cast<Eigen::Index>(n)], 0.0, 0.0, 0.0, 0.0};
    }
    const double led_rad = moving.joints().dq_radps[kKnee] * (robot.drives.delay_s + seconds(late_ns));
    const double q_rad = feedback.q_rad[kKnee] + led_rad;
    command.joints[kKnee] = {q_rad + 0.1, 5.0, 150.0, 400.0, 10.0};
    moving.to_drives(command);
    return torque_asked_nm(command.joints[kKnee], q_rad, moving.joints().dq_radps[kKnee]);
  };
  EXPECT_NEAR(asked_nm(6.0, 0), torque_available_nm(limits, 6.0), 1e-9);
  EXPECT_NEAR(asked_nm(6.0, kTick_ns), torque_available_nm(limits, 6.0), 1e-9);
  EXPECT_LT(torque_available_nm(limits, 6.0), 100.0);
  EXPECT_NEAR(asked_nm(0.0, 0), 240.0, 1e-9) << "150 + 40 + 50 Nm, which a slow drive cuts itself";
  EXPECT_NEAR(asked_nm(8.0, 0), 0.0, 1e-9) << "faster than without a load, but it may brake";
}

}  // namespace
}  // namespace polygmap
