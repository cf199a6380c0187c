// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/imu_mount.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/nominal_robot.hpp"
#include "tests/support/standing_torques.hpp"

namespace polygmap {
namespace {

constexpr ImuMount::Params kMountParams;
constexpr double kTwoDegrees_rad = 0.035;
const std::array<Vec2, 4> kWays{Vec2{1.0, 0.0}, Vec2{-1.0, 0.0}, Vec2{0.0, 1.0}, Vec2{0.0, -1.0}};

Vec2 turn_of(const Vec2& soles_rad, const Vec2& statics_rad) {
  return ImuMount::turn_rad(kMountParams, {soles_rad, statics_rad});
}

TEST(ImuMount, WithinItsDataSheet_IsLeftAlone) {
  for (const Vec2& way : kWays) {
    EXPECT_LT(turn_of(0.006 * way, 0.004 * way).norm(), 0.5e-3);
    EXPECT_LT(turn_of(0.006 * way, -0.01 * way).norm(), 0.5e-3);
  }
}

TEST(ImuMount, SolesAndWeightAgree_IsTurnedByMostOfIt) {
  for (const Vec2& way : kWays) {
    EXPECT_LT((turn_of(kTwoDegrees_rad * way, kTwoDegrees_rad * way) - kTwoDegrees_rad * way).norm(), 3e-3);
    EXPECT_LT((turn_of(0.06 * way, 0.05 * way) - 0.06 * way).norm(), 5e-3);
  }
}

TEST(ImuMount, SolesAlone_TheFloorSlopes) {
  for (const Vec2& way : kWays) EXPECT_LT(turn_of(kTwoDegrees_rad * way, Vec2::Zero()).norm(), 4e-3);
}

TEST(ImuMount, WeightAlone_TheMassesAreOff) {
  for (const Vec2& way : kWays) {
    EXPECT_LT(turn_of(Vec2::Zero(), 0.02 * way).norm(), 1e-3);
    EXPECT_LT(turn_of(Vec2::Zero(), kTwoDegrees_rad * way).norm(), 2e-3);
  }
}

TEST(ImuMount, AllThreeDisagree_IsTurnedByLittle) {
  EXPECT_LT(turn_of({kTwoDegrees_rad, 0.0}, {-kTwoDegrees_rad, 0.0}).norm(), 3e-3);
  EXPECT_LT(turn_of({kTwoDegrees_rad, 0.0}, {0.0, kTwoDegrees_rad}).norm(), 10e-3);
}

TEST(ImuMount, EverLargerTurns_NeverLeaps) {
  double before_rad = 0.0;
  for (double both_rad = 0.0; both_rad < 0.08; both_rad += 1e-4) {
    const double turn_rad = turn_of({both_rad, 0.0}, {both_rad, 0.0}).x();
    EXPECT_GE(turn_rad, before_rad);
    EXPECT_LT(turn_rad - before_rad, 5e-4) << both_rad;
    before_rad = turn_rad;
  }
}

TEST(ImuMount, TurnsThatNothingExplains_AreFinite) {
  EXPECT_TRUE(math::all_finite(turn_of({3.0, 0.0}, {-3.0, 1.0})));
  EXPECT_TRUE(math::all_finite(turn_of({1e6, 0.0}, {1e6, 1.0})));
}

// A robot stands upright; its IMU feels gravity as if it leant.
ImuMount heard(const Vec3& base_up_felt, const JointFeedback& joints, int ticks = 500) {
  ImuMount mount;
  mount.reset(kMountParams);
  for (int i = 0; i < ticks; ++i) mount.add(kGravity_mps2 * base_up_felt, joints);
  return mount;
}

TEST(ImuMount, MountedTwoDegreesOff_FeltGravityIsTurnedUpright) {
  const JointFeedback joints = test::standing_on_both(Vec3::UnitZ(), 0.5);
  for (const Mat3& felt_R_base : {rotation_x(kTwoDegrees_rad), rotation_x(-kTwoDegrees_rad),
                                  rotation_y(kTwoDegrees_rad), rotation_y(-kTwoDegrees_rad)}) {
    const Vec3 felt = felt_R_base.col(2);
    const Mat3 base_R_felt = heard(felt, joints).base_R_felt(nominal_robot());
    EXPECT_LT((base_R_felt * felt).head<2>().norm(), 4e-3);
    EXPECT_NEAR(yaw_of(base_R_felt), 0.0, 1e-6);
  }
}

// The ankles' torques are those of a robot whose weight hangs where the IMU feels it.
TEST(ImuMount, FloorSlopesByTwoDegrees_IsLeftAlone) {
  for (const Mat3& base_R_up : {rotation_x(kTwoDegrees_rad), rotation_y(-kTwoDegrees_rad)}) {
    const Vec3 up = base_R_up.col(2);
    const Mat3 base_R_felt = heard(up, test::standing_on_both(up, 0.5)).base_R_felt(nominal_robot());
    EXPECT_LT((base_R_felt * up - up).norm(), 4e-3);
  }
}

TEST(ImuMount, NoTorquesTold_IsLeftAlone) {
  const Vec3 felt = rotation_y(kTwoDegrees_rad).col(2);
  JointFeedback joints = test::standing_on_both(Vec3::UnitZ(), 0.5);
  joints.tau_nm.setConstant(std::nan(""));
  EXPECT_EQ(heard(felt, joints).base_R_felt(nominal_robot()), Mat3::Identity());
  joints.tau_nm.setZero();
  EXPECT_EQ(heard(felt, joints).base_R_felt(nominal_robot()), Mat3::Identity());
  EXPECT_EQ(heard(felt, test::standing_on_both(Vec3::UnitZ(), 0.5), 0).base_R_felt(nominal_robot()), Mat3::Identity());
}

TEST(ImuMount, Forgotten_CountsNoMore) {
  ImuMount mount = heard(rotation_y(kTwoDegrees_rad).col(2), test::standing_on_both(Vec3::UnitZ(), 0.5));
  mount.forget();
  mount.add(kGravity_mps2 * Vec3::UnitZ(), test::standing_on_both(Vec3::UnitZ(), 0.5));
  EXPECT_LT((mount.base_R_felt(nominal_robot()) - Mat3::Identity()).norm(), 1e-4);
}

TEST(ImuMount, MostIsSmall_IsTurnedByNoMore) {
  ImuMount mount;
  ImuMount::Params params;
  params.most_rad = 0.01;
  mount.reset(params);
  const Vec3 felt = rotation_y(kTwoDegrees_rad).col(2);
  mount.add(kGravity_mps2 * felt, test::standing_on_both(Vec3::UnitZ(), 0.5));
  EXPECT_NEAR((mount.base_R_felt(nominal_robot()) * felt - felt).norm(), 0.01, 1e-6);
}

}  // namespace
}  // namespace polygmap
