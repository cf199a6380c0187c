// SPDX-License-Identifier: Apache-2.0
// Straight lines and half-planes in a plane, metres.
#pragma once

#include <optional>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

[[nodiscard]] inline double cross(const Vec2& a, const Vec2& b) noexcept { return a.x() * b.y() - a.y() * b.x(); }
// A quarter turn to the left.
[[nodiscard]] inline Vec2 left_of(const Vec2& v) noexcept { return {-v.y(), v.x()}; }
[[nodiscard]] inline Vec2 unit_at(double angle_rad) noexcept { return {math::cos(angle_rad), math::sin(angle_rad)}; }

struct Line2 {
  Vec2 point_m = Vec2::Zero();
  Vec2 direction = Vec2::UnitX();  // unit
};

// Empty when the points coincide or are not finite.
[[nodiscard]] inline std::optional<Line2> line_through(const Vec2& a_m, const Vec2& b_m) noexcept {
  const Vec2 d = b_m - a_m;
  const double length_m = math::sqrt(d.squaredNorm());
  if (!(length_m > 1e-9) || !std::isfinite(length_m)) return std::nullopt;
  return Line2{a_m, d / length_m};
}

// The points with inward . p >= offset_m.
struct HalfPlane {
  Vec2 inward = Vec2::UnitX();  // unit
  double offset_m = 0.0;

  // Positive inside.
  [[nodiscard]] double distance_m(const Vec2& p_m) const noexcept { return inward.dot(p_m) - offset_m; }
};
[[nodiscard]] inline HalfPlane left_side(const Line2& line) noexcept {
  const Vec2 inward = left_of(line.direction);
  return {inward, inward.dot(line.point_m)};
}

}  // namespace polygmap
