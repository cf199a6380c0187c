// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/footstep_plan.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

TEST(FootOfTorso_Eq31, TurnedTorso_FeetStandBesideIt) {
  const TorsoPose torso{{1.0, 2.0, 0.9}, kPi / 2};  // eq. (29): x, y, z, phi
  const SolePose left = foot_of_torso(torso, Foot::kLeft, 0.1, 0.8);
  const SolePose right = foot_of_torso(torso, Foot::kRight, 0.1, 0.8);
  EXPECT_LT((left.position_m - Vec3(0.9, 2.0, 0.1)).norm(), 1e-12);
  EXPECT_LT((right.position_m - Vec3(1.1, 2.0, 0.1)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(left.yaw_rad, kPi / 2);
}

TEST(FootOfTorso_Eq31, ThereAndBack_IsTheSameTorso) {
  const TorsoPose torso{{-0.3, 0.7, 0.8}, -2.9};
  const TorsoPose back = torso_of_foot(foot_of_torso(torso, Foot::kRight, 0.11, 0.79), Foot::kRight, 0.11, 0.79);
  EXPECT_LT((back.position_m - torso.position_m).norm(), 1e-12);
  EXPECT_NEAR(back.yaw_rad, torso.yaw_rad, 1e-12);
}

TEST(Displacement_Eq35, TurnedFrame_IsLocal) {
  const TorsoPose before{{1, 1, 0}, kPi / 2}, after{{1, 1.2, 0}, kPi / 2 + 0.1};
  const TorsoDisplacement step = displacement(before, after);
  EXPECT_LT((step.local_m - Vec3(0.2, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(step.turn_rad, 0.1, 1e-12);
}

TEST(Displacement_Eq35, AcrossTheCut_TurnsTheShortWay) {
  EXPECT_NEAR(displacement({{}, 3.1}, {{}, -3.1}).turn_rad, 2 * kPi - 6.2, 1e-12);
}

TEST(SwingFoot_Eq36, TurnsAndSideSteps_PickTheirSide) {
  const SwingRule rule;
  EXPECT_EQ(swing_foot({{0.1, 0.05, 0}, 0.0}, Foot::kRight, rule), Foot::kLeft);
  EXPECT_EQ(swing_foot({{0.1, -0.05, 0}, 0.0}, Foot::kLeft, rule), Foot::kRight);
  EXPECT_EQ(swing_foot({{0.1, 0, 0}, 0.1}, Foot::kRight, rule), Foot::kLeft);
  EXPECT_EQ(swing_foot({{0.1, 0, 0}, -0.1}, Foot::kLeft, rule), Foot::kRight);
}

TEST(SwingFoot_Eq36, StraightAhead_GaitStateDecides) {
  const SwingRule rule;
  EXPECT_EQ(swing_foot({{0.2, 0.002, 0}, 0.001}, Foot::kLeft, rule), Foot::kLeft);
  EXPECT_EQ(swing_foot({{0.2, -0.002, 0}, -0.001}, Foot::kRight, rule), Foot::kRight);
}

TEST(FloorStep_Eq34, RandomGoals_FeetNeverOverlapAndStayInLimits) {
  std::mt19937 random(3);
  std::uniform_real_distribution<> place(-0.6, 0.6), angle(-0.6, 0.6);
  const FloorStepLimits limits;
  for (int i = 0; i < 5000; ++i) {
    const Foot foot = i % 2 == 0 ? Foot::kLeft : Foot::kRight;
    const SolePose stance{{place(random), place(random), 0.02}, angle(random)};
    const TorsoPose goal{{place(random), place(random), 0.0}, angle(random)};
    const SolePose step = floor_step(kCollisionRectangle, stance, foot, goal, kStanceHalfWidth_m, limits);
    EXPECT_FALSE(
        overlap(foot_rectangle(kCollisionRectangle, step, 0.0), foot_rectangle(kCollisionRectangle, stance, 0.0)));
    EXPECT_DOUBLE_EQ(step.position_m.z(), stance.position_m.z());
    EXPECT_LE(std::abs(math::wrap_angle(step.yaw_rad - stance.yaw_rad)), limits.turn_rad + 1e-12);
    const Vec3 local = rotation_z(stance.yaw_rad).transpose() * (step.position_m - stance.position_m);
    EXPECT_LE(std::abs(local.x()), limits.forward_m + kStanceHalfWidth_m * limits.turn_rad + 1e-9);
    EXPECT_GT(side_sign(foot) * local.y(), 0.09);
    EXPECT_LT(side_sign(foot) * local.y(), 0.2 + limits.lateral_m + 0.13);
  }
}

TEST(FloorStep, GoalWithinOneStep_LandsBesideIt) {
  const SolePose stance{{0, -0.1, 0}, 0};
  const SolePose step = floor_step(kCollisionRectangle, stance, Foot::kLeft, {{0.15, 0.03, 0}, 0.1}, 0.1, {});
  const SolePose wanted = foot_of_torso({{0.15, 0.03, 0}, 0.1}, Foot::kLeft, 0.1, 0.0);
  EXPECT_LT((step.position_m - wanted.position_m).norm(), 1e-12);
}
}  // namespace
}  // namespace polygmap
