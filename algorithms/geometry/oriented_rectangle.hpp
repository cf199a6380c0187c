// SPDX-License-Identifier: Apache-2.0
// A rectangle in the ground plane at any heading: the space a foot occupies (eq. 34).
#pragma once

#include "algorithms/core/math/math.hpp"

namespace polygmap {

struct OrientedRectangle {
  Vec2 centre_m = Vec2::Zero();
  double half_length_m = 0.0;  // along the heading
  double half_width_m = 0.0;
  double yaw_rad = 0.0;
};

// Eq. (34): whether two feet share ground. Separating axes: two convex shapes are apart when their shadows on the
// direction of one of their edges are; touching is not overlap.
[[nodiscard]] inline bool overlap(const OrientedRectangle& a, const OrientedRectangle& b) noexcept {
  const Vec2 between = b.centre_m - a.centre_m;
  const Vec2 ax{math::cos(a.yaw_rad), math::sin(a.yaw_rad)}, ay{-ax.y(), ax.x()};
  const Vec2 bx{math::cos(b.yaw_rad), math::sin(b.yaw_rad)}, by{-bx.y(), bx.x()};
  const auto apart = [&](const Vec2& axis) noexcept {
    const double reach_m = a.half_length_m * std::abs(axis.dot(ax)) + a.half_width_m * std::abs(axis.dot(ay)) +
                           b.half_length_m * std::abs(axis.dot(bx)) + b.half_width_m * std::abs(axis.dot(by));
    return std::abs(axis.dot(between)) >= reach_m;
  };
  return !(apart(ax) || apart(ay) || apart(bx) || apart(by));
}

}  // namespace polygmap
