// SPDX-License-Identifier: Apache-2.0
// A robot at rest whose IMU is not mounted as configured: what the standstill makes of it.
#include <gtest/gtest.h>

#include "algorithms/estimation/estimator.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/standing_torques.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_ns;

class EstimatorImuMountTest : public ::testing::Test {
 protected:
  void SetUp() override { estimator_.reset({}, nominal_robot()); }
  // The robot stands upright; its IMU is turned in the base, and feels it turn by that, true axes.
  void tick(const Mat3& base_R_imu, const Vec3& base_w_radps = Vec3::Zero()) {
    t_ns_ += kTick_ns;
    estimator_.add_imu(
        {t_ns_, base_R_imu.transpose() * base_w_radps, kGravity_mps2 * (base_R_imu.transpose() * Vec3::UnitZ())},
        t_ns_);
    joints_.stamp_ns = t_ns_;
    estimator_.add_joints(joints_, t_ns_);
    estimator_.tick({true, true});
  }
  // To the tick with which the standstill is over.
  [[nodiscard]] bool stand(const Mat3& base_R_imu) {
    for (int i = 0; i < 1000 && !estimator_.state().initialised; ++i) tick(base_R_imu);
    return estimator_.state().initialised;
  }
  [[nodiscard]] double lean_rad() const { return estimator_.state().odom_T_base.R.col(2).head<2>().norm(); }

  static Estimator estimator_;  // its ring is too large for a stack
  std::int64_t t_ns_ = 0;
  JointFeedback joints_ = test::standing_on_both(Vec3::UnitZ(), 0.5);
};
Estimator EstimatorImuMountTest::estimator_;

TEST_F(EstimatorImuMountTest, PitchedOrRolledByTwoDegrees_AttitudeIsRightAtTheStandstillsEnd) {
  for (const Mat3& base_R_imu : {rotation_y(0.035), rotation_y(-0.035), rotation_x(0.035), rotation_x(-0.035)}) {
    estimator_.reset({}, nominal_robot());
    for (int i = 0; i < 250; ++i) tick(base_R_imu);
    EXPECT_FALSE(estimator_.state().initialised);
    EXPECT_NEAR(lean_rad(), 0.035, 2e-3) << "as it is felt";
    EXPECT_TRUE(estimator_.state().odom_turned_rad.isZero(0.0));
    ASSERT_TRUE(stand(base_R_imu));
    EXPECT_LT(lean_rad(), 4e-3);
    EXPECT_NEAR(estimator_.state().odom_turned_rad.norm(), 0.035, 4e-3);
    for (int i = 0; i < 500; ++i) {
      tick(base_R_imu);
      EXPECT_TRUE(estimator_.state().odom_turned_rad.isZero(0.0)) << "told once";
    }
    EXPECT_LT(lean_rad(), 4e-3) << "later samples are turned, too";
    EXPECT_LT(estimator_.state().odom_v_base_mps.norm(), 5e-3);
  }
}

TEST_F(EstimatorImuMountTest, RolledImu_LaterTurnIsFeltAboutTheTrueAxis) {
  const Mat3 base_R_imu = rotation_x(0.05);
  ASSERT_TRUE(stand(base_R_imu));
  tick(base_R_imu, {0.0, 0.0, 1.0});
  EXPECT_NEAR(estimator_.state().base_w_base_radps.z(), 1.0, 0.01);
  EXPECT_LT(estimator_.state().base_w_base_radps.head<2>().norm(), 5e-3);
}

// What it is told twice would be taken twice.
TEST_F(EstimatorImuMountTest, TickWithoutNewSamples_TellsOfNoTurn) {
  ASSERT_TRUE(stand(rotation_y(0.035)));
  EXPECT_GT(estimator_.state().odom_turned_rad.norm(), 0.03);
  estimator_.tick({true, true});
  EXPECT_TRUE(estimator_.state().odom_turned_rad.isZero(0.0));
}

TEST_F(EstimatorImuMountTest, NoTorquesTold_NothingIsTurned) {
  joints_.tau_nm.setZero();
  ASSERT_TRUE(stand(rotation_y(0.035)));
  EXPECT_NEAR(lean_rad(), 0.035, 2e-3);
  EXPECT_TRUE(estimator_.state().odom_turned_rad.isZero(0.0));
}

TEST_F(EstimatorImuMountTest, FloorSlopesByTwoDegrees_NothingIsTurned) {
  const Mat3 base_R_up = rotation_y(0.035);
  joints_ = test::standing_on_both(base_R_up.col(2), 0.5);
  ASSERT_TRUE(stand(base_R_up.transpose()));
  EXPECT_LT((estimator_.state().odom_T_base.R * base_R_up.col(2) - Vec3::UnitZ()).norm(), 4e-3);
}

}  // namespace
}  // namespace polygmap
