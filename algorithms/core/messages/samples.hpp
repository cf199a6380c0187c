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

// Some of the joints, by joint_index().
class JointSet {
 public:
  constexpr JointSet() = default;
  [[nodiscard]] static constexpr JointSet all() noexcept { return of_bits((1U << kJointCount) - 1U); }
  // Bit n is joint n; bits beyond the last joint do not count.
  [[nodiscard]] static constexpr JointSet of_bits(std::uint32_t bits) noexcept {
    JointSet set;
    set.bits_ = static_cast<std::uint16_t>(bits & ((1U << kJointCount) - 1U));
    return set;
  }
  constexpr void insert(std::size_t joint) noexcept { *this = of_bits(bits_ | 1U << joint); }
  [[nodiscard]] constexpr bool contains(std::size_t joint) const noexcept { return (bits_ >> joint & 1U) != 0U; }
  [[nodiscard]] constexpr bool is_empty() const noexcept { return bits_ == 0U; }
  [[nodiscard]] constexpr bool is_all() const noexcept { return *this == all(); }
  [[nodiscard]] constexpr std::uint16_t bits() const noexcept { return bits_; }
  [[nodiscard]] constexpr bool operator==(const JointSet&) const noexcept = default;

 private:
  static_assert(kJointCount <= 16);
  std::uint16_t bits_ = 0;
};

// In the stead of a temperature that nobody told.
inline constexpr std::int16_t kNotTold_degc = -32768;

inline constexpr std::int64_t kBusCycle_ns = 2 * kNsPerMs;  // a command to every drive, and its reply

struct JointFeedback {
  static constexpr std::uint16_t kNeverHeard = 0xFFFF;

  std::int64_t stamp_ns = 0;  // of the newest replies
  JointVector q_rad = JointVector::Zero();
  JointVector dq_radps = JointVector::Zero();
  JointVector tau_nm = JointVector::Zero();  // not a number where a drive tells none
  // How many cycles before stamp_ns the joint's own reply lies: 0 where it is as new as the stamp. A silent drive's
  // joint keeps its last values and counts up; kNeverHeard: it has no values yet.
  std::array<std::uint16_t, kJointCount> silent_cycles{};
  [[nodiscard]] constexpr std::int64_t silent_ns(std::size_t joint) const noexcept {
    return silent_cycles[joint] * kBusCycle_ns;
  }
  // A joint whose drive is silent goes on at its last speed for so long, then stays where that took it: the drive is
  // mute, and its leg is no measurement any more.
  static constexpr std::uint16_t kCarried_cycles = 5;
  [[nodiscard]] constexpr bool is_mute(std::size_t joint) const noexcept {
    return silent_cycles[joint] > kCarried_cycles;
  }
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
