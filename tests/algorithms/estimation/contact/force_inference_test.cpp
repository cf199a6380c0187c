// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/force_inference.hpp"

#include <gtest/gtest.h>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

TEST(ForceInference, StaticTorquesOfAStandingLeg_GiveItsForce_FrictionOfALightOneNone) {
  const LegGeometry geometry;
  JointFeedback joints;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const Transform sole{rotation_z(0.1), Vec3{0.05, side_sign(leg) * 0.1, -0.72}};
    const LegVector q = solve_leg(geometry, leg, sole).q_rad;
    Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();
    wrench[2] = 300.0;
    const auto at = static_cast<Eigen::Index>(joint_index(leg, 0));
    joints.q_rad.segment<6>(at) = q;
    joints.tau_nm.segment<6>(at) = -leg_jacobian(geometry, leg, q).transpose() * wrench;
  }
  joints.tau_nm.tail<6>().setConstant(1.0);  // the right leg: friction alone
  ForceInference inference;
  inference.reset({});
  const auto force_n = inference.update(geometry, joints, Vec3::UnitZ());
  EXPECT_NEAR(force_n[0], 300.0, 6.0);
  EXPECT_EQ(force_n[1], 0.0);
}

}  // namespace
}  // namespace polygmap
