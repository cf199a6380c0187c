// SPDX-License-Identifier: Apache-2.0
// The closed-form leg kinematics against KDL's chain solvers: written by others, of other formulas.
#include <gtest/gtest.h>

#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>
#include <random>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

KDL::Vector kdl(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// Segment by segment: a joint at its parent's tip, then the way to the next joint.
KDL::Chain kdl_leg(const LegGeometry& g, Foot leg) {
  const auto sided = [leg](const Vec3& left_m) { return kdl({left_m.x(), side_sign(leg) * left_m.y(), left_m.z()}); };
  const auto joint = [](KDL::Joint::JointType type, const KDL::Vector& to_next_m) {
    return KDL::Segment(KDL::Joint(type), KDL::Frame(to_next_m));
  };
  KDL::Chain chain;
  chain.addSegment(joint(KDL::Joint::None, sided(g.base_p_hip_m)));
  chain.addSegment(joint(KDL::Joint::RotX, KDL::Vector::Zero()));
  chain.addSegment(joint(KDL::Joint::RotZ, sided(g.hip_p_hip_pitch_m)));
  chain.addSegment(joint(KDL::Joint::RotY, kdl({0, 0, -g.thigh_m})));
  chain.addSegment(joint(KDL::Joint::RotY, kdl({0, 0, -g.shank_m})));
  chain.addSegment(joint(KDL::Joint::RotY, KDL::Vector::Zero()));
  chain.addSegment(joint(KDL::Joint::RotX, kdl({0, 0, -g.ankle_to_sole_m})));
  return chain;
}

TEST(LegKinematicsAgainstKdl, RandomJointsOfBothLegs_SoleAndJacobianAgree) {
  LegGeometry geometry;
  geometry.thigh_m *= 1.013;  // not the default's numbers
  geometry.hip_p_hip_pitch_m.y() -= 0.02;
  std::mt19937 random(7);
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const KDL::Chain chain = kdl_leg(geometry, leg);
    KDL::ChainFkSolverPos_recursive forward(chain);
    KDL::ChainJntToJacSolver jacobian_of(chain);
    for (int i = 0; i < 1000; ++i) {
      KDL::JntArray joints(kJointsPerLeg);
      LegVector q_rad;
      for (unsigned j = 0; j < kJointsPerLeg; ++j) {
        const JointLimits& limits = joint_limits(leg, j);
        joints(j) = q_rad[j] = std::uniform_real_distribution<>(limits.min_rad, limits.max_rad)(random);
      }
      KDL::Frame frame;
      KDL::Jacobian jacobian(kJointsPerLeg);
      ASSERT_EQ(forward.JntToCart(joints, frame), 0);
      ASSERT_EQ(jacobian_of.JntToJac(joints, jacobian), 0);  // of the tip, in base axes
      const Transform sole = base_T_sole(geometry, leg, q_rad);
      for (int r = 0; r < 3; ++r) {
        ASSERT_NEAR(sole.p_m[r], frame.p(r), 1e-12);
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(sole.R(r, c), frame.M(r, c), 1e-12);
      }
      // Number by number: the library's Eigen may align its matrices otherwise than this build's.
      const LegJacobian ours = leg_jacobian(leg_frames(geometry, leg, q_rad));
      for (unsigned r = 0; r < 6; ++r) {
        for (unsigned c = 0; c < kJointsPerLeg; ++c) ASSERT_NEAR(ours(r, c), jacobian(r, c), 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace polygmap
