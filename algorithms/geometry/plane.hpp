// SPDX-License-Identifier: Apache-2.0
// Planes in space: normal . p + d = 0, metres.
#pragma once

#include "algorithms/core/math/transform.hpp"

namespace polygmap {

struct Plane {
  Vec3 normal = Vec3::UnitZ();  // unit
  double d_m = 0.0;

  // Positive on the side the normal points to.
  [[nodiscard]] double distance_m(const Vec3& p_m) const noexcept { return normal.dot(p_m) + d_m; }
  [[nodiscard]] Vec3 project(const Vec3& p_m) const noexcept { return p_m - distance_m(p_m) * normal; }
  // z of the plane at (x, y); only for planes that are not upright (normal.z() != 0).
  [[nodiscard]] double height_m(const Vec2& p_m) const noexcept {
    return -(normal.head<2>().dot(p_m) + d_m) / normal.z();
  }
};

[[nodiscard]] inline Plane operator*(const Transform& a_T_b, const Plane& plane) noexcept {
  const Vec3 normal = a_T_b.R * plane.normal;
  return {normal, plane.d_m - normal.dot(a_T_b.p_m)};
}

}  // namespace polygmap
