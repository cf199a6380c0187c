// SPDX-License-Identifier: Apache-2.0
// What sensors deliver and drives take. Every sample has the monotonic stamp of the moment it describes, ns.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/math/math.hpp"
#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/time.hpp"

namespace polygmap {

enum class Foot : std::uint8_t { kLeft = 0, kRight = 1 };
[[nodiscard]] constexpr std::size_t index_of(Foot foot) noexcept { return static_cast<std::size_t>(foot); }
[[nodiscard]] constexpr Foot other(Foot foot) noexcept { return foot == Foot::kLeft ? Foot::kRight : Foot::kLeft; }

struct ImuSample {  // in the base frame; the accelerometer measures specific force (+g up at rest)
  std::int64_t stamp_ns = 0;
  Vec3 gyro_radps = Vec3::Zero();
  Vec3 accel_mps2 = Vec3::Zero();
};

using JointVector = Eigen::Matrix<double, static_cast<int>(kJointCount), 1>;
using LegVector = Eigen::Matrix<double, static_cast<int>(kJointsPerLeg), 1>;

struct JointFeedback {
  std::int64_t stamp_ns = 0;
  JointVector q_rad = JointVector::Zero();
  JointVector dq_radps = JointVector::Zero();
  JointVector tau_nm = JointVector::Zero();       // not a number where a drive tells none
  std::array<double, kFootCount> foot_force_n{};  // vertical, 0 in the air
};

struct JointSetpoint {
  double q_rad = 0.0;
  double dq_radps = 0.0;
  double tau_ff_nm = 0.0;
  double kp_nmprad = 0.0;
  double kd_nmsprad = 0.0;
};
struct JointCommand {
  std::int64_t stamp_ns = 0;
  std::array<JointSetpoint, kJointCount> joints{};
};

// One pose of the lidar in the odometry's own world, as it arrives: late, noisy, possibly wrong.
struct LioSample {
  std::int64_t stamp_ns = 0;  // of the scan, not of the arrival
  Transform lio_T_lidar;
  Vec3 position_sigma_m = Vec3::Zero();
  Vec3 rotation_sigma_rad = Vec3::Zero();
};

// Pinhole, pixel centres at integers; x right, y down, z forward (camera frame). No distortion.
struct CameraIntrinsics {
  std::int32_t width_px = kDepthWidth_px;
  std::int32_t height_px = kDepthHeight_px;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  double depth_unit_m = 0.001;
};

// A view of a driver's buffer, row-major, width x height, 0 = invalid; valid until the port is told to release it.
struct DepthFrameView {
  std::int64_t stamp_ns = 0;  // middle of the exposure
  std::uint32_t sequence = 0;
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  const std::uint16_t* depth = nullptr;
};

}  // namespace polygmap
