// SPDX-License-Identifier: Apache-2.0
// How the simulated robot differs from its data sheet, and how its sensors lie: unknown to the module.
#pragma once

#include <array>
#include <cstdint>

#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {

// Standard deviations unless named otherwise. Source: the project's sensor figures (an assumption, not a measurement).
struct ErrorParams {
  double leg_length = 0.005;  // relative, thigh and shank; nine tenths of the variance common to both legs
  double encoder_offset_rad = 2e-3;
  double encoder_noise_rad = 2e-4;
  double joint_rate_noise_radps = 2e-3;
  double imu_mount_rad = 0.2 * kPi / 180.0;  // per axis
  double gyro_bias_radps = 2e-3;
  double gyro_noise_radps = 2e-3;
  double accel_bias_mps2 = 0.05;
  double accel_noise_mps2 = 0.05;
  double lio_position_m = 0.010;
  double lio_rotation_rad = 0.2 * kPi / 180.0;
  double depth_scale = 0.003;             // half range, uniform
  double camera_mount_rad = kPi / 180.0;  // half range, uniform, each of roll, pitch and yaw in the base
  double camera_mount_m = 0.003;          // half range, uniform, per axis
  double torque_noise_nm = 0.5;           // of a measured joint torque, white
  double friction_nm = 1.0;  // Coulomb, of a moving joint: what the drive measures and the leg does not feel
  double depth_noise = 1.0;  // scales sigma, warp, edge mixing and dropouts: 0 or 1

  [[nodiscard]] static constexpr ErrorParams none() noexcept {
    return {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  }
};

// What a seed makes of one robot, constant over its run.
struct RobotErrors {
  std::array<LegGeometry, kFootCount> legs{nominal_robot().legs, nominal_robot().legs};  // true lengths
  JointVector encoder_offset_rad = JointVector::Zero();  // encoder reading minus true angle
  Mat3 base_R_imu = Mat3::Identity();
  Vec3 gyro_bias_radps = Vec3::Zero();
  Vec3 accel_bias_mps2 = Vec3::Zero();
  double depth_scale = 1.0;
  Transform base_T_camera = nominal_robot().mounts.base_T_camera;  // true mount
  Transform lio_T_true;  // LIO's own world: level, with its own origin and yaw
};

[[nodiscard]] RobotErrors draw_errors(const ErrorParams& params, std::uint64_t seed);

}  // namespace polygmap::sim
