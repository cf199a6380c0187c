// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/leg_sensing.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace polygmap
