// SPDX-License-Identifier: Apache-2.0
// Convex polygons in a plane: vertices counter-clockwise, metres. Fewer than three vertices: empty.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/geometry/line.hpp"

namespace polygmap {

// Twice a surface's vertices: the intersection of two surfaces always fits.
inline constexpr std::size_t kMaxConvexVertices = 2 * kMaxPolygonVertices;
using ConvexPolygon = StaticVector<Vec2, kMaxConvexVertices>;

struct BoundingBox {
  Vec2 min_m = Vec2::Zero();
  Vec2 max_m = Vec2::Zero();
};

// The convex hull of a point set, eq. (15), counter-clockwise without collinear vertices: Andrew's monotone chain.
// Coincident points are one. Sorts by heap: no recursion, no memory.
template <std::size_t N>
[[nodiscard]] StaticVector<Vec2, N> convex_hull(StaticVector<Vec2, N> points_m) noexcept {
  const auto before = [](const Vec2& a, const Vec2& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); };
  std::make_heap(points_m.begin(), points_m.end(), before);
  std::sort_heap(points_m.begin(), points_m.end(), before);

  StaticVector<Vec2, N + 1> hull;
  const auto add = [&hull](const Vec2& p, std::size_t keep) {
    while (hull.size() > keep && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0) {
      (void)hull.try_pop_back();
    }
    (void)hull.try_push_back(p);
  };
  for (std::size_t i = 0; i < points_m.size(); ++i) add(points_m[i], 1);
  const std::size_t lower = hull.size();
  for (std::size_t i = points_m.size(); i-- > 1;) add(points_m[i - 1], lower);

  StaticVector<Vec2, N> out;  // the chain ends where it began
  for (std::size_t i = 0; i + 1 < hull.size(); ++i) (void)out.try_push_back(hull[i]);
  return out;
}

// The smallest axis-parallel box around the vertices, eq. (16).
[[nodiscard]] BoundingBox bounding_box(const ConvexPolygon& polygon) noexcept;

[[nodiscard]] double area_m2(const ConvexPolygon& polygon) noexcept;
[[nodiscard]] Vec2 centroid_m(const ConvexPolygon& polygon) noexcept;

// The inside of edge i (vertex i to i + 1).
[[nodiscard]] HalfPlane edge_half_plane(const ConvexPolygon& polygon, std::size_t i) noexcept;

// Inside or on the boundary, eq. (17).
[[nodiscard]] bool contains(const ConvexPolygon& polygon, const Vec2& p_m) noexcept;

// Euclidean distance to the boundary: positive inside, negative outside, -inf for an empty polygon.
[[nodiscard]] double signed_distance_m(const ConvexPolygon& polygon, const Vec2& p_m) noexcept;

// The part of the line y = y_m inside the polygon: x from min to max; false when they miss each other.
struct Interval {
  double min_m = 0.0;
  double max_m = 0.0;
};
[[nodiscard]] bool row_interval(const ConvexPolygon& polygon, double y_m, Interval& x) noexcept;

// The largest u . v over the vertices v; -inf for an empty polygon.
[[nodiscard]] double support_m(const ConvexPolygon& polygon, const Vec2& u) noexcept;

// What each edge came from, carried through clipping.
using EdgeTags = std::array<std::uint8_t, kMaxConvexVertices>;

// The part of the polygon inside a half-plane. With tags, edges keep theirs and the cut gets cut_tag.
[[nodiscard]] ConvexPolygon clip(const ConvexPolygon& polygon, const HalfPlane& half_plane, EdgeTags* tags = nullptr,
                                 std::uint8_t cut_tag = 0) noexcept;
[[nodiscard]] ConvexPolygon intersection(const ConvexPolygon& a, const ConvexPolygon& b) noexcept;

}  // namespace polygmap
