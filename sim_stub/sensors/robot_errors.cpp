// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/sensors/robot_errors.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "sim_stub/camera/counter_noise.hpp"
#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

// Off its data sheet by up to so much, about each of the base's axes and along it.
Transform mounted(const Transform& nominal, const CounterNoise& draws, double most_rad, double most_m) {
  const auto within = [&draws](std::uint64_t index, double half) { return draws.uniform(index, -half, half); };
  return {rotation_zyx(within(2, most_rad), within(1, most_rad), within(0, most_rad)) * nominal.R,
          nominal.p_m + Vec3{within(3, most_m), within(4, most_m), within(5, most_m)}};
}

}  // namespace

RobotErrors draw_errors(const ErrorParams& params, std::uint64_t seed) {
  RobotErrors errors;
  const CounterNoise lengths(seed, Stream::kLegLengths), offsets(seed, Stream::kEncoderOffsets);
  const CounterNoise lio(seed, Stream::kLioWorld);

  // One production batch: what a data sheet gets wrong is mostly the same in both legs.
  const double common = params.leg_length * std::sqrt(0.9), own = params.leg_length * std::sqrt(0.1);
  for (std::size_t f = 0; f < kFootCount; ++f) {
    errors.legs[f].thigh_m *= 1.0 + common * lengths.normal(0) + own * lengths.normal(2 + 2 * f);
    errors.legs[f].shank_m *= 1.0 + common * lengths.normal(1) + own * lengths.normal(3 + 2 * f);
  }
  for (SoleRectangle* sole : {&errors.sole.contact, &errors.sole.collision}) {
    sole->toe_x_m += params.toe_m;
    sole->heel_x_m -= params.heel_m;
    sole->half_width_m += 0.5 * params.sole_width_m;
  }
  errors.toe_round_m = params.toe_round_m;
  errors.sole_edge_m = params.sole_edge_m;
  for (std::size_t j = 0; j < kJointCount; ++j) {
    errors.encoder_offset_rad[static_cast<Eigen::Index>(j)] = params.encoder_offset_rad * offsets.normal(j);
  }
  const Vec3 imu_rad = params.imu_turned_rad + params.imu_mount_rad * CounterNoise(seed, Stream::kImuMount).normal3(0);
  errors.base_R_imu = rotation_zyx(imu_rad.z(), imu_rad.y(), imu_rad.x());
  errors.gyro_bias_radps = params.gyro_bias_radps * CounterNoise(seed, Stream::kGyroBias).normal3(0);
  errors.accel_bias_mps2 = params.accel_bias_mps2 * CounterNoise(seed, Stream::kAccelBias).normal3(0);
  errors.depth_scale =
      1.0 + CounterNoise(seed, Stream::kDepthScale).uniform(0, -params.depth_scale, params.depth_scale);
  errors.base_T_camera = mounted(nominal_robot().mounts.base_T_camera, {seed, Stream::kCameraMount},
                                 params.camera_mount_rad, params.camera_mount_m);
  errors.base_T_lidar = mounted(nominal_robot().mounts.base_T_lidar, {seed, Stream::kLidarMount}, params.lio_mount_rad,
                                params.lio_mount_m);
  const Vec3& turned_rad = params.lio_turned_rad;
  errors.base_T_lidar.R = rotation_zyx(turned_rad.z(), turned_rad.y(), turned_rad.x()) * errors.base_T_lidar.R;
  errors.lio_T_true = {rotation_z(lio.uniform(0, -kPi, kPi)),
                       Vec3{lio.uniform(1, -5, 5), lio.uniform(2, -5, 5), lio.uniform(3, -1, 1)}};
  return errors;
}

}  // namespace polygmap::sim
