// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/stance_check.hpp"

#include <gtest/gtest.h>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

constexpr StanceCheck::Params kParams;
constexpr double kDegree_rad = kPi / 180.0;

// Legs that stand with both soles parallel to the base's floor, turned by that in the base.
JointVector standing_q_rad(const Mat3& base_R_floor) {
  JointVector q_rad;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const Transform base_T_sole{base_R_floor,
                                base_R_floor * Vec3{0.0, side_sign(foot) * kStanceHalfWidth_m, -kNominalBaseHeight_m}};
    q_rad.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
        solve_leg(nominal_robot().legs, foot, base_T_sole).q_rad;
  }
  return q_rad;
}
StanceCheck::Leans leans_of(const Vec3& base_accel_mps2, const JointVector& q_rad) {
  return StanceCheck::leans(nominal_robot().legs, q_rad, base_accel_mps2);
}
const Vec3 kUp_mps2{0.0, 0.0, kGravity_mps2};

TEST(StanceCheck, ImuTurned_LeansByTheTurnsTiltAndNotByItsYaw) {
  const JointVector q_rad = standing_q_rad(Mat3::Identity());
  EXPECT_LT(leans_of(kUp_mps2, q_rad).gravity_rad, 1e-6);
  EXPECT_LT(leans_of(rotation_z(1.5) * kUp_mps2, q_rad).gravity_rad, 1e-6);
  for (const double lean_rad : {0.01, 13.0 * kDegree_rad, 0.5 * kPi, 3.0}) {
    EXPECT_NEAR(leans_of(rotation_x(lean_rad) * kUp_mps2, q_rad).gravity_rad, lean_rad, 1e-6);
    EXPECT_NEAR(leans_of(rotation_y(-lean_rad) * kUp_mps2, q_rad).gravity_rad, lean_rad, 1e-6);
  }
  EXPECT_NEAR(leans_of(-kUp_mps2, q_rad).gravity_rad, kPi, 1e-6) << "upside down";
  EXPECT_LT(leans_of(rotation_x(1.0) * kUp_mps2, q_rad).soles_rad, 1e-6);
}

TEST(StanceCheck, TorsoLeansOnLevelFloor_IsNoLean) {
  const Mat3 base_R_floor = rotation_y(0.2) * rotation_x(-0.05);
  const StanceCheck::Leans leans = leans_of(base_R_floor * kUp_mps2, standing_q_rad(base_R_floor));
  EXPECT_LT(leans.gravity_rad, 1e-6);
  EXPECT_LT(leans.soles_rad, 1e-6);
}

TEST(StanceCheck, FloorOfTwoDegrees_IsWithinTheTolerance) {
  const Mat3 slope_R = rotation_y(2.0 * kDegree_rad);
  EXPECT_LT(leans_of(kUp_mps2, standing_q_rad(slope_R)).gravity_rad, 0.5 * kParams.most_gravity_rad);
}

// A zero that is off by 13 deg, and a sign that is wrong, in one leg.
TEST(StanceCheck, EncoderOfOneLegIsWrong_TheSolesLean) {
  for (const std::size_t joint : {kHipRoll, kHipPitch, kKnee, kAnklePitch, kAnkleRoll}) {
    JointVector q_rad = standing_q_rad(Mat3::Identity());
    q_rad[static_cast<Eigen::Index>(joint)] += 13.0 * kDegree_rad;
    EXPECT_GT(leans_of(kUp_mps2, q_rad).soles_rad, kParams.most_soles_rad) << kLegJointNames[joint];
  }
  JointVector q_rad = standing_q_rad(Mat3::Identity());
  q_rad[kAnklePitch] = -q_rad[kAnklePitch];
  EXPECT_GT(leans_of(kUp_mps2, q_rad).soles_rad, kParams.most_soles_rad);
}

}  // namespace
}  // namespace polygmap
