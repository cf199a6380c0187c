// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "algorithms/robot/body_shapes.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

LegVector random_joints(std::mt19937& random, Foot leg) {
  LegVector q;
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const JointLimits& limits = joint_limits(leg, j);
    q[static_cast<int>(j)] = std::uniform_real_distribution<>(limits.min_rad, limits.max_rad)(random);
  }
  q[kHipPitch] = std::uniform_real_distribution<>(-1.3, 0.3)(random);
  q[kKnee] = std::uniform_real_distribution<>(0.02, 2.2)(random);
  return q;
}

TEST(LegKinematics, SolveLeg_SolesOfRandomJoints_ReturnsTheJoints) {
  std::mt19937 random(1);
  const LegGeometry geometry;
  int checked = 0;
  for (int i = 0; i < 100000; ++i) {
    const Foot leg = i % 2 == 0 ? Foot::kLeft : Foot::kRight;
    const LegVector q = random_joints(random, leg);
    if (std::abs(q[kHipPitch] + q[kKnee] + q[kAnklePitch]) > 1.2) continue;  // the foot is never upside down
    ++checked;
    const LegSolution solution = solve_leg(geometry, leg, base_T_sole(geometry, leg, q));
    EXPECT_TRUE(solution.reachable);
    EXPECT_GE(limit_margin_rad(nominal_robot().drives, leg, solution.q_rad), -1e-9);
    ASSERT_LT((solution.q_rad - q).cwiseAbs().maxCoeff(), 1e-9) << q.transpose();
  }
  EXPECT_GT(checked, 50000);
}

TEST(LegKinematics, SolveLeg_SoleOutOfReach_SaysSoAndStaysFinite) {
  const LegSolution solution = solve_leg({}, Foot::kLeft, {Mat3::Identity(), Vec3{0, 0.1, -1.2}});
  EXPECT_FALSE(solution.reachable);
  EXPECT_TRUE(math::all_finite(solution.q_rad));
}

TEST(LegKinematics, Jacobian_AgainstCentralDifferences_Agrees) {
  std::mt19937 random(2);
  const LegGeometry geometry;
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 200; ++i) {
    const Foot leg = i % 2 == 0 ? Foot::kLeft : Foot::kRight;
    const LegVector q = random_joints(random, leg);
    const LegJacobian jacobian = leg_jacobian(leg_frames(geometry, leg, q));
    for (int j = 0; j < static_cast<int>(kJointsPerLeg); ++j) {
      LegVector hi = q, lo = q;
      hi[j] += kStep;
      lo[j] -= kStep;
      const Transform a = base_T_sole(geometry, leg, lo), b = base_T_sole(geometry, leg, hi);
      const Mat3 w = (b.R - a.R) / (2 * kStep) * base_T_sole(geometry, leg, q).R.transpose();
      EXPECT_LT(((b.p_m - a.p_m) / (2 * kStep) - jacobian.block<3, 1>(0, j)).norm(), 1e-6);
      EXPECT_LT((Vec3{w(2, 1), w(0, 2), w(1, 0)} - jacobian.block<3, 1>(3, j)).norm(), 1e-6);
    }
  }
}

TEST(LegKinematics, SoleAtZeroJoints_IsStraightLegHeightBelowBase) {
  // kuavo.md: straight-leg pelvis height 0.884 m is to the foot's lowest mesh point; to the contact plane it is 0.8892
  // m.
  const Transform sole = base_T_sole({}, Foot::kLeft, LegVector::Zero());
  EXPECT_NEAR(sole.p_m.z(), -(0.066 + 0.1287 + 0.284 + 0.346 + 0.0645), 1e-12);
  EXPECT_NEAR(sole.p_m.y(), 0.086, 1e-12);
}

TEST(BodyShapes, SignedDistance_PointsInAndOut_HaveTheirSign) {
  const Capsule capsule{{0, 0, 0}, {0, 0, 1}, 0.1};
  EXPECT_NEAR(signed_distance_m(capsule, {0.3, 0, 0.5}), 0.2, 1e-12);
  EXPECT_NEAR(signed_distance_m(capsule, {0, 0, 1.3}), 0.2, 1e-12);
  EXPECT_NEAR(signed_distance_m(capsule, {0, 0.05, 0.5}), -0.05, 1e-12);
  const OrientedBox box{{rotation_z(kPi / 2), Vec3{1, 0, 0}}, Vec3{0.2, 0.1, 0.05}};
  EXPECT_NEAR(signed_distance_m(box, {1, 0.3, 0}), 0.1, 1e-12);
  EXPECT_NEAR(signed_distance_m(box, {1, 0, 0}), -0.05, 1e-12);
}

}  // namespace
}  // namespace polygmap
