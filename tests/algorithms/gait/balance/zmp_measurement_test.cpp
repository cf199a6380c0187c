// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/zmp_measurement.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/robot/leg_dynamics.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

// Both legs bent, soles level, and pressed off their middles.
struct PressedSoles {
  MassModel masses;
  JointFeedback felt;
  std::array<Transform, kFootCount> odom_T_sole;
  Vec2 zmp_m = Vec2::Zero();
  Vec2 slope{0.03, -0.05};

  PressedSoles() {
    const std::array<Vec3, kFootCount> local_m{Vec3{0.05, 0.01, 0.0}, Vec3{-0.02, -0.02, 0.0}};
    constexpr std::array kForce_n{200.0, 340.0};
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      const std::size_t f = index_of(leg);
      odom_T_sole[f] = {rotation_z(0.2), Vec3{0.2 * static_cast<double>(f), 0.11 * side_sign(leg), -0.75}};
      const LegVector q_rad = solve_leg({}, leg, odom_T_sole[f]).q_rad;  // the base at odometry's origin
      const Vec3 force_n = kForce_n[f] * Vec3{slope.x(), slope.y(), 1.0};
      std::array<Vec3, kJointsPerLeg> weight_mps2;
      weight_mps2.fill({0, 0, -kGravity_mps2});
      const SoleWrench ground{force_n, (odom_T_sole[f].R * local_m[f]).cross(force_n)};
      felt.tau_nm.segment<6>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
          leg_torques_nm(masses, leg, leg_frames({}, leg, q_rad), weight_mps2, ground);
      felt.foot_force_n[f] = kForce_n[f];
      zmp_m += kForce_n[f] / 540.0 * (odom_T_sole[f] * local_m[f]).head<2>();
    }
  }
  [[nodiscard]] bool try_measure(Vec2& measured_m) const {
    return try_measure_zmp({}, nominal_robot(), felt, odom_T_sole, slope, measured_m);
  }
};

TEST(ZmpMeasurement, SolesPressedOffTheirMiddles_AreFound) {
  Vec2 measured_m;
  const PressedSoles soles;
  ASSERT_TRUE(soles.try_measure(measured_m));
  EXPECT_LT((measured_m - soles.zmp_m).norm(), 0.3e-3);  // the foot is also weighed
}

TEST(ZmpMeasurement, NothingTold_IsNone) {
  const Vec2 before{7.0, 8.0};
  Vec2 measured_m = before;
  PressedSoles no_torque;
  no_torque.felt.tau_nm[kAnklePitch] = std::nan("");
  EXPECT_FALSE(no_torque.try_measure(measured_m));
  PressedSoles drives_that_tell_none;
  drives_that_tell_none.felt.tau_nm.setZero();
  EXPECT_FALSE(drives_that_tell_none.try_measure(measured_m));
  PressedSoles no_force;
  no_force.felt.foot_force_n.fill(std::nan(""));
  EXPECT_FALSE(no_force.try_measure(measured_m));
  PressedSoles dead_sensor;
  dead_sensor.felt.foot_force_n[1] = 0.0;
  EXPECT_FALSE(dead_sensor.try_measure(measured_m));
  EXPECT_EQ(measured_m, before);
}

}  // namespace
}  // namespace polygmap
