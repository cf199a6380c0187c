// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/standing_vertical.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/bent_legs.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/standing_torques.hpp"

namespace polygmap {
namespace {

using test::standing_on_both;

double angle_rad(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

TEST(UpBySoles, LegsThatDiffer_IsBetweenTheirNormals) {
  const JointVector q_rad = test::bent_q_rad();
  const Vec3 up = up_by_soles({}, q_rad);
  const BodyFrames frames = body_frames({}, q_rad);
  const Vec3 left = frames[0].sole.R.col(2), right = frames[1].sole.R.col(2);
  EXPECT_NEAR(angle_rad(up, left), angle_rad(up, right), 1e-9);
  EXPECT_NEAR(angle_rad(up, left) + angle_rad(up, right), angle_rad(left, right), 1e-9);
}

TEST(UpByStatics, RobotThatLeans_IsWhereItsWeightHangs) {
  for (const Vec2& lean : {Vec2{0.0, 0.0}, Vec2{0.05, 0.0}, Vec2{-0.05, 0.0}, Vec2{0.03, 0.06}, Vec2{0.0, -0.05}}) {
    for (const double left_share : {0.35, 0.5, 0.7}) {
      const Vec3 true_up = Vec3{lean.x(), lean.y(), 1.0}.normalized();
      Vec3 up = Vec3::Zero();
      ASSERT_TRUE(try_up_by_statics({}, nominal_robot(), standing_on_both(true_up, left_share), up));
      EXPECT_LT(angle_rad(up, true_up), 2e-3) << lean.transpose() << ", left " << left_share;
    }
  }
}

// What a load of 3 kg held 0.4 m ahead does: 22 mm over 0.8 m.
TEST(UpByStatics, MassesOff_ErrsByTheirCentreOverItsHeight) {
  RobotModel believed = nominal_robot();
  believed.masses.torso.centre_m.x() += 0.02;
  Vec3 up = Vec3::Zero();
  ASSERT_TRUE(try_up_by_statics({}, believed, standing_on_both(Vec3::UnitZ(), 0.5), up));
  EXPECT_NEAR(up.x(), 0.016, 3e-3);
  EXPECT_NEAR(up.y(), 0.0, 1e-3);
}

TEST(UpByStatics, NothingTold_IsNone) {
  const Vec3 before{7.0, 8.0, 9.0};
  const auto is_none = [&](auto&& spoil) {
    JointFeedback felt = standing_on_both(Vec3::UnitZ(), 0.5);
    spoil(felt);
    Vec3 up = before;
    return !try_up_by_statics({}, nominal_robot(), felt, up) && up == before;
  };
  EXPECT_FALSE(is_none([](JointFeedback&) {}));
  EXPECT_TRUE(is_none([](JointFeedback& felt) { felt.tau_nm.setZero(); }));
  EXPECT_TRUE(is_none([](JointFeedback& felt) { felt.tau_nm[kAnkleRoll] = std::nan(""); }));
  EXPECT_TRUE(is_none([](JointFeedback& felt) { felt.foot_force_n[0] = std::nan(""); }));
  EXPECT_TRUE(is_none([](JointFeedback& felt) { felt.foot_force_n = {540.0, 0.0}; }));
  EXPECT_TRUE(is_none([](JointFeedback& felt) { felt.foot_force_n = {150.0, 150.0}; }));
  EXPECT_TRUE(is_none([](JointFeedback& felt) { felt.foot_force_n = {500.0, 500.0}; }));
}

}  // namespace
}  // namespace polygmap
