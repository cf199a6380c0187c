// SPDX-License-Identifier: Apache-2.0
// A rigid transform. a_T_b maps coordinates in frame b to coordinates in frame a: p_a = a_T_b * p_b.
#pragma once

#include "algorithms/core/math/math.hpp"

namespace polygmap {

struct Transform {
  Mat3 R = Mat3::Identity();
  Vec3 p_m = Vec3::Zero();

  [[nodiscard]] Vec3 operator*(const Vec3& point_m) const noexcept { return R * point_m + p_m; }
  [[nodiscard]] Transform operator*(const Transform& other) const noexcept {
    return {R * other.R, R * other.p_m + p_m};
  }
  [[nodiscard]] Transform inverse() const noexcept { return {R.transpose(), -(R.transpose() * p_m)}; }
};

[[nodiscard]] inline Mat3 rotation_x(double angle_rad) noexcept {
  const auto [s, c] = math::sin_cos(angle_rad);
  return (Mat3() << 1, 0, 0, 0, c, -s, 0, s, c).finished();
}
[[nodiscard]] inline Mat3 rotation_y(double angle_rad) noexcept {
  const auto [s, c] = math::sin_cos(angle_rad);
  return (Mat3() << c, 0, s, 0, 1, 0, -s, 0, c).finished();
}
// The paper's R_z, eq. (31).
[[nodiscard]] inline Mat3 rotation_z(double angle_rad) noexcept {
  const auto [s, c] = math::sin_cos(angle_rad);
  return (Mat3() << c, -s, 0, s, c, 0, 0, 0, 1).finished();
}
// R_z R_y R_x: yaw, then pitch, then roll of the turned axes.
[[nodiscard]] inline Mat3 rotation_zyx(double yaw_rad, double pitch_rad, double roll_rad) noexcept {
  const auto [sin, cos] = math::sin_cos(std::array{yaw_rad, pitch_rad, roll_rad, 0.0});
  const math::SinCos z{sin[0], cos[0]}, y{sin[1], cos[1]}, x{sin[2], cos[2]};
  Mat3 R;
  R.col(0) << z.cos * y.cos, z.sin * y.cos, -y.sin;
  R.col(1) << z.cos * y.sin * x.sin - z.sin * x.cos, z.sin * y.sin * x.sin + z.cos * x.cos, y.cos * x.sin;
  R.col(2) << z.cos * y.sin * x.cos + z.sin * x.sin, z.sin * y.sin * x.cos - z.cos * x.sin, y.cos * x.cos;
  return R;
}
// Heading of the x axis in the horizontal plane, rad, in (-pi, pi].
[[nodiscard]] inline double yaw_of(const Mat3& R) noexcept { return math::atan2(R(1, 0), R(0, 0)); }

}  // namespace polygmap
