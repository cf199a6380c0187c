// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/climb_planner.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

// The standing foot slid and turned under a push, and the other one landed far out.
TEST(ClimbPlanner, ClosesUpBesideAFootThatTurned_LandsAsFarAlongTheTreadAsItsFoothold) {
  const RobotModel robot;
  ClimbPlanner planner;
  planner.reset({}, robot);
  constexpr double kYaw_rad = 0.4;  // of the stairs
  const Mat3 odom_R_stairs = rotation_z(kYaw_rad);
  ClimbPlanner::Decision landed;
  landed.has_step = true;
  landed.goal.kind = StepKind::kTrailing;
  landed.goal.target = {odom_R_stairs * Vec3{1.0, 0.1, 0.13}, kYaw_rad};
  landed.goal.foothold.polygon_id = 7;
  ClimbPlanner::Situation situation;
  situation.soles = {SolePose{odom_R_stairs * Vec3{0.96, 0.17, 0.131}, kYaw_rad},
                     SolePose{odom_R_stairs * Vec3{0.985, -0.105, 0.129}, kYaw_rad + 0.055}};
  planner.latched(situation, landed);
  planner.landed();
  ClimbPlanner::Decision aborted;  // a swing that went back is none that landed
  aborted.goal.kind = StepKind::kLeading;
  aborted.goal.foot = Foot::kRight;
  aborted.goal.target = {odom_R_stairs * Vec3{1.3, -0.1, 0.26}, kYaw_rad};
  planner.latched(situation, aborted);
  planner.swing_aborted();
  ASSERT_TRUE(planner.close_up(situation));

  const ClimbPlanner::Decision closing = planner.decide(situation, {});
  ASSERT_TRUE(closing.has_step);
  EXPECT_EQ(closing.goal.kind, StepKind::kClosing);
  EXPECT_EQ(closing.goal.foot, Foot::kLeft);
  EXPECT_EQ(closing.goal.foothold.polygon_id, 7U);
  EXPECT_NEAR(closing.goal.target.yaw_rad, kYaw_rad, 1e-12);
  const Vec3 stairs_p_m = odom_R_stairs.transpose() * closing.goal.target.position_m;
  EXPECT_NEAR(stairs_p_m.x(), 1.0, 1e-12);
  EXPECT_NEAR(stairs_p_m.y(), -0.105 + 2.0 * robot.stance.half_width_m, 1e-12);
  EXPECT_NEAR(stairs_p_m.z(), 0.129, 1e-12);
}

}  // namespace
}  // namespace polygmap
