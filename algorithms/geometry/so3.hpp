// SPDX-License-Identifier: Apache-2.0
// The rotation group: rotation vectors (axis times angle, rad) and rotation matrices.
#pragma once

#include <Eigen/Geometry>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

[[nodiscard]] inline Mat3 skew(const Vec3& v) noexcept {
  return (Mat3() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

// exp of eq. (8): Rodrigues' formula, its series below 0.1 mrad where the quotients lose digits.
[[nodiscard]] inline Mat3 so3_exp(const Vec3& rotation_rad) noexcept {
  const double angle2 = rotation_rad.squaredNorm();
  const double angle = math::sqrt(angle2);
  const bool tiny = angle < 1e-4;
  const double a = tiny ? 1.0 - angle2 / 6.0 : math::sin(angle) / angle;
  const double b = tiny ? 0.5 - angle2 / 24.0 : (1.0 - math::cos(angle)) / angle2;
  const Mat3 K = skew(rotation_rad);
  return Mat3::Identity() + a * K + b * (K * K);
}

// log of eq. (7): the rotation vector with an angle in [0, pi]. Through the quaternion whose largest component is found
// first, so it keeps its digits at the identity and at half a turn.
[[nodiscard]] inline Vec3 so3_log(const Mat3& R) noexcept {
  const double trace = R.trace();
  double w = 0.0;
  Vec3 v;
  if (trace > 0.0) {
    w = 0.5 * math::sqrt(1.0 + trace);
    v = Vec3{R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)} / (4.0 * w);
  } else {
    int i = 0;
    if (R(1, 1) > R(0, 0)) i = 1;
    if (R(2, 2) > R(i, i)) i = 2;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    v[i] = 0.5 * math::sqrt(1.0 + R(i, i) - R(j, j) - R(k, k));
    v[j] = (R(j, i) + R(i, j)) / (4.0 * v[i]);
    v[k] = (R(k, i) + R(i, k)) / (4.0 * v[i]);
    w = (R(k, j) - R(j, k)) / (4.0 * v[i]);
  }
  if (w < 0.0) {
    w = -w;
    v = -v;
  }
  const double n = v.norm();
  return n < 1e-9 ? Vec3(2.0 * v / w) : Vec3(2.0 * math::atan2(n, w) / n * v);
}

// One Newton step towards the nearest rotation: removes rounding that products have gathered.
[[nodiscard]] inline Mat3 so3_renormalised(const Mat3& R) noexcept {
  return 0.5 * R * (3.0 * Mat3::Identity() - R.transpose() * R);
}
[[nodiscard]] inline bool is_rotation(const Mat3& R, double tolerance) noexcept {
  return math::all_finite(R) && (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < tolerance &&
         R.col(0).cross(R.col(1)).dot(R.col(2)) > 0.0;
}

}  // namespace polygmap
