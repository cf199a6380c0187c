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
  // What a data sheet does not say at all; 0 unless told (sim_stub/reality.hpp).
  Vec3 imu_turned_rad = Vec3::Zero();  // roll, pitch and yaw of the IMU's mount besides its spread
  double encoder_step_rad = 0.0;
  bool rates_by_difference = false;  // of encoder readings, tick by tick, in place of a rate that is measured
  double foot_force_noise_n = 0.0;
  std::array<double, kFootCount> foot_force_offset_n{};
  double foot_force_mass_kg = 0.0;                // of the foot below the sensor, whose acceleration it feels
  Vec3 lio_drift_mps = Vec3::Zero();              // true axes
  double lio_drift_radps = 0.0;                   // of its yaw
  double lio_walk_mprs = 0.0;                     // random walk, per axis
  double lio_mount_rad = 0.0, lio_mount_m = 0.0;  // half range, uniform, per axis
  Vec3 lio_turned_rad = Vec3::Zero();             // roll, pitch and yaw of the lidar's mount besides that
  Vec3 lio_jump_m = Vec3::Zero();                 // at lio_jump_s, true axes
  double lio_jump_s = 20.0;
  double lio_outage_s = 0.0;  // from lio_outage_from_s on it says nothing for so long
  double lio_outage_from_s = 20.0;
  double lio_sigma_scale = 1.0;      // true noise over the stated one
  double toe_m = 0.0, heel_m = 0.0;  // by which the foot is longer in front and behind
  double sole_width_m = 0.0;         // by which it is wider, both sides together
  double toe_round_m = 0.0;          // radius of the toe's two corners, seen from above
  double sole_edge_m = 0.0;          // of the sole's length, in front and behind, worn off its underside
  double gyro_scale = 1.0, accel_scale = 1.0, foot_force_scale = 1.0;  // read over true
  double imu_delay_s = 0.0;                                            // by which a sample is older than its stamp
  double foot_force_delay_s = 0.006;
  double lio_delay_s = 0.1;
  double lio_stamp_s = 0.0;  // by which the stamp is later than the pose

  [[nodiscard]] static ErrorParams none() noexcept { return {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}; }

  static void visit(auto& p, auto& field) {
    field("leg_length", p.leg_length, 0.0, 0.1, "Spread of thigh and shank, relative.");
    field("encoder_offset_rad", p.encoder_offset_rad, 0.0, 0.1, "Spread of the encoders' offsets.");
    field("encoder_noise_rad", p.encoder_noise_rad, 0.0, 0.01, "White noise of an encoder.");
    field("encoder_step_rad", p.encoder_step_rad, 0.0, 0.01, "Step of an encoder's readings; 0: none.");
    field("joint_rate_noise_radps", p.joint_rate_noise_radps, 0.0, 1.0, "White noise of a measured joint speed.");
    field("rates_by_difference", p.rates_by_difference, "A joint's speed is the difference of two readings.");
    field("imu_mount_rad", p.imu_mount_rad, 0.0, 0.2, "Spread of the IMU's mount, per axis.");
    field("imu_turned_rad", p.imu_turned_rad, -0.3, 0.3, "Roll, pitch and yaw of the IMU's mount besides that.");
    field("gyro_bias_radps", p.gyro_bias_radps, 0.0, 0.1, "Spread of the gyroscope's bias, per axis.");
    field("gyro_noise_radps", p.gyro_noise_radps, 0.0, 0.1, "White noise of the gyroscope.");
    field("accel_bias_mps2", p.accel_bias_mps2, 0.0, 1.0, "Spread of the accelerometer's bias, per axis.");
    field("accel_noise_mps2", p.accel_noise_mps2, 0.0, 5.0, "White noise of the accelerometer.");
    field("torque_noise_nm", p.torque_noise_nm, 0.0, 20.0, "White noise of a measured torque.");
    field("friction_nm", p.friction_nm, 0.0, 20.0, "Coulomb friction that a drive measures and the leg does not feel.");
    field("foot_force_noise_n", p.foot_force_noise_n, 0.0, 200.0, "White noise of a foot force.");
    field("foot_force_offset_n", p.foot_force_offset_n, -300.0, 300.0, "Zero error of the left and right foot force.");
    field("foot_force_mass_kg", p.foot_force_mass_kg, 0.0, 5.0, "Of the foot below its sensor, which feels it move.");
    field("lio_position_m", p.lio_position_m, 0.0, 0.2, "White noise of the LIO position.");
    field("lio_rotation_rad", p.lio_rotation_rad, 0.0, 0.2, "White noise of the LIO rotation.");
    field("lio_sigma_scale", p.lio_sigma_scale, 0.1, 10.0, "True LIO noise over the stated one.");
    field("lio_drift_mps", p.lio_drift_mps, -0.2, 0.2, "Steady drift of the LIO position; x up the stairs, z up.");
    field("lio_drift_radps", p.lio_drift_radps, -0.2, 0.2, "Steady drift of the LIO yaw.");
    field("lio_walk_mprs", p.lio_walk_mprs, 0.0, 0.1, "Random walk of the LIO position, per axis.");
    field("lio_mount_rad", p.lio_mount_rad, 0.0, 0.1, "Half range of the lidar's mount, per axis.");
    field("lio_turned_rad", p.lio_turned_rad, -0.3, 0.3, "Roll, pitch and yaw of the lidar's mount besides that.");
    field("lio_mount_m", p.lio_mount_m, 0.0, 0.1, "Half range of the lidar's place, per axis.");
    field("lio_jump_m", p.lio_jump_m, -2.0, 2.0, "Jump of the LIO position, for good.");
    field("lio_jump_s", p.lio_jump_s, 0.0, 1000.0, "When it jumps.");
    field("lio_outage_s", p.lio_outage_s, 0.0, 1000.0, "For how long the LIO says nothing.");
    field("lio_outage_from_s", p.lio_outage_from_s, 0.0, 1000.0, "When that begins.");
    field("depth_scale", p.depth_scale, 0.0, 0.1, "Half range of the camera's scale error.");
    field("camera_mount_rad", p.camera_mount_rad, 0.0, 0.1, "Half range of the camera's mount, per axis.");
    field("camera_mount_m", p.camera_mount_m, 0.0, 0.05, "Half range of the camera's place, per axis.");
    field("depth_noise", p.depth_noise, 0.0, 20.0, "Depth noise over the believed one.");
    field("toe_m", p.toe_m, -0.05, 0.05, "By which the foot is longer in front.");
    field("heel_m", p.heel_m, -0.05, 0.05, "By which the foot is longer behind.");
    field("sole_width_m", p.sole_width_m, -0.03, 0.03, "By which the foot is wider, both sides together.");
    field("toe_round_m", p.toe_round_m, 0.0, 0.045, "Radius of the toe's two corners, seen from above.");
    field("sole_edge_m", p.sole_edge_m, 0.0, 0.02,
          "Of the sole's length, in front and behind, worn off its underside.");
    field("gyro_scale", p.gyro_scale, 0.9, 1.1, "What the gyroscope reads over the true rate.");
    field("accel_scale", p.accel_scale, 0.9, 1.1, "What the accelerometer reads over the true specific force.");
    field("imu_delay_s", p.imu_delay_s, 0.0, 0.05,
          "By which a sample is older than its stamp, in whole ticks of 2 ms.");
    field("foot_force_scale", p.foot_force_scale, 0.5, 1.5, "What a foot force reads over the true one.");
    field("foot_force_delay_s", p.foot_force_delay_s, 0.0, 0.05, "Of a foot force, in whole ticks of 2 ms.");
    field("lio_delay_s", p.lio_delay_s, 0.0, 0.4, "From a scan to its pose's arrival.");
    field("lio_stamp_s", p.lio_stamp_s, -0.05, 0.05, "By which a pose's stamp is later than its scan.");
  }
};

// What a seed makes of one robot, constant over its run.
struct RobotErrors {
  std::array<LegGeometry, kFootCount> legs{nominal_robot().legs, nominal_robot().legs};  // true lengths
  SoleModel sole = nominal_robot().sole;
  double toe_round_m = 0.0, sole_edge_m = 0.0;           // as ErrorParams has them
  JointVector encoder_offset_rad = JointVector::Zero();  // encoder reading minus true angle
  Mat3 base_R_imu = Mat3::Identity();
  Vec3 gyro_bias_radps = Vec3::Zero();
  Vec3 accel_bias_mps2 = Vec3::Zero();
  double depth_scale = 1.0;
  Transform base_T_camera = nominal_robot().mounts.base_T_camera;  // true mount
  Transform base_T_lidar = nominal_robot().mounts.base_T_lidar;    // true mount
  Transform lio_T_true;  // LIO's own world: level, with its own origin and yaw
};

[[nodiscard]] RobotErrors draw_errors(const ErrorParams& params, std::uint64_t seed);

}  // namespace polygmap::sim
