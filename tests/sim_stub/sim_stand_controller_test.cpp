// SPDX-License-Identifier: Apache-2.0
// Whoever holds the robot before the module, and the drives' own limits that hold for both.
#include <gtest/gtest.h>

#include "sim_stub/sim_robot.hpp"
#include "sim_stub/stand_controller.hpp"

namespace polygmap::sim {
namespace {

constexpr std::array<double, kJointsPerLeg> kKuavo_nmprad{220, 100, 224, 224, 58, 58};

SimOptions standing(const std::array<double, kJointsPerLeg>& kp_most_nmprad) {
  SimOptions options;
  options.plant_kind = PlantKind::kMujoco;
  options.mujoco.kp_most_nmprad = kp_most_nmprad;
  options.camera.silent = {{0, std::numeric_limits<std::int64_t>::max()}};
  return options;
}

TEST(StandController, GainsOfARealRobot_KeepItStandingStill) {
  SimRobot robot(standing(kKuavo_nmprad));
  const Vec3 com_m = robot.truth().true_p_com_m;
  for (int i = 0; i < 2500; ++i) robot.advance();
  EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;
  EXPECT_LT((robot.truth().true_p_com_m - com_m).norm(), 0.005);
}

TEST(StandController, SofterHolder_GivesWayFartherAndHolds) {
  const auto moved_m = [](double holder_kp_nmprad) {
    SimOptions options = standing({});
    options.mujoco.holder_kp_nmprad = holder_kp_nmprad;
    SimRobot robot(options);
    const Vec3 com_m = robot.truth().true_p_com_m;
    robot.plant().push({15.0, 0.0, 0.0});
    for (int i = 0; i < 300; ++i) robot.advance();
    EXPECT_FALSE(robot.truth().fell);
    return (robot.truth().true_p_com_m - com_m).norm();
  };
  EXPECT_GT(moved_m(150.0), 1.2 * moved_m(2000.0));
}

TEST(StandController, CommandThatAsksNothing_DoesNotTakeOver) {
  SimRobot robot(standing(kKuavo_nmprad));
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(robot.try_write({}).is_all());
    robot.advance();
  }
  EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;
}

// A knee told to go elsewhere gives the same torque whether it is told with the limit or with more.
TEST(DriveLimits, GainsBeyondThem_ActAsTheLimit) {
  const auto torque_nm = [](double kp_nmprad, double kd_nmsprad) {
    SimOptions options = standing({});
    options.errors = ErrorParams::none();
    options.mujoco.kp_most_nmprad[kKnee] = 250.0;
    options.mujoco.kd_most_nmsprad[kKnee] = 5.0;
    SimRobot robot(options);
    JointFeedback feedback;
    EXPECT_TRUE(robot.try_read(feedback));
    JointCommand command;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      command.joints[n] = {feedback.q_rad[static_cast<Eigen::Index>(n)], 0.0, 0.0, 200.0, 4.0};
    }
    JointSetpoint& knee = command.joints[kKnee];
    knee = {knee.q_rad + 0.1, 1.0, 0.0, kp_nmprad, kd_nmsprad};
    EXPECT_TRUE(robot.try_write(command).is_all());
    for (int i = 0; i < 2; ++i) robot.advance();
    return robot.truth().drive_tau_nm[kKnee];
  };
  EXPECT_EQ(torque_nm(2000.0, 40.0), torque_nm(250.0, 5.0));
  EXPECT_GT(torque_nm(250.0, 5.0), torque_nm(200.0, 5.0) + 2.0);
  EXPECT_GT(torque_nm(250.0, 5.0), torque_nm(250.0, 3.0) + 1.0);
}

}  // namespace
}  // namespace polygmap::sim
