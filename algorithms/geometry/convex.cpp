// SPDX-License-Identifier: Apache-2.0
#include "algorithms/geometry/convex.hpp"

#include <limits>

namespace polygmap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

[[nodiscard]] const Vec2& next(const ConvexPolygon& polygon, std::size_t i) noexcept {
  return polygon[i + 1 == polygon.size() ? 0 : i + 1];
}

[[nodiscard]] double distance_to_segment_m(const Vec2& a, const Vec2& b, const Vec2& p) noexcept {
  const Vec2 ab = b - a;
  const double along = math::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-24), 0.0, 1.0);
  return math::sqrt((p - a - along * ab).squaredNorm());
}

}  // namespace

BoundingBox bounding_box(const ConvexPolygon& polygon) noexcept {
  if (polygon.empty()) return {};
  BoundingBox box{polygon[0], polygon[0]};
  for (const Vec2& v : polygon) {
    box.min_m = box.min_m.cwiseMin(v);
    box.max_m = box.max_m.cwiseMax(v);
  }
  return box;
}

double area_m2(const ConvexPolygon& polygon) noexcept {
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    twice += cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
  }
  return 0.5 * twice;
}

Vec2 centroid_m(const ConvexPolygon& polygon) noexcept {
  if (polygon.empty()) return Vec2::Zero();
  Vec2 moment = Vec2::Zero();  // from vertex 0, so that far polygons lose no digits
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Vec2 a = polygon[i] - polygon[0], b = polygon[i + 1] - polygon[0];
    const double c = cross(a, b);
    twice += c;
    moment += c * (a + b) / 3.0;
  }
  return twice > 1e-12 ? Vec2{polygon[0] + moment / twice} : polygon[0];
}

HalfPlane edge_half_plane(const ConvexPolygon& polygon, std::size_t i) noexcept {
  const std::optional<Line2> line = line_through(polygon[i], next(polygon, i));
  return line ? left_side(*line) : HalfPlane{Vec2::Zero(), -kInfinity};  // a point bounds nothing
}

bool contains(const ConvexPolygon& polygon, const Vec2& p_m) noexcept {
  if (polygon.size() < 3) return false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    if (cross(next(polygon, i) - polygon[i], p_m - polygon[i]) < 0.0) return false;
  }
  return true;
}

double signed_distance_m(const ConvexPolygon& polygon, const Vec2& p_m) noexcept {
  if (polygon.size() < 3) return -kInfinity;
  double nearest = kInfinity;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    nearest = std::min(nearest, distance_to_segment_m(polygon[i], next(polygon, i), p_m));
  }
  return contains(polygon, p_m) ? nearest : -nearest;
}

bool row_interval(const ConvexPolygon& polygon, double y_m, Interval& x) noexcept {
  if (polygon.size() < 3) return false;
  Interval found{kInfinity, -kInfinity};
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = next(polygon, i);
    if ((a.y() - y_m) * (b.y() - y_m) > 0.0) continue;  // both ends on one side
    const double dy = b.y() - a.y();
    const double x0 = dy == 0.0 ? a.x() : a.x() + (b.x() - a.x()) * ((y_m - a.y()) / dy);
    const double x1 = dy == 0.0 ? b.x() : x0;
    found.min_m = std::min({found.min_m, x0, x1});
    found.max_m = std::max({found.max_m, x0, x1});
  }
  if (!(found.min_m <= found.max_m)) return false;
  x = found;
  return true;
}

double support_m(const ConvexPolygon& polygon, const Vec2& u) noexcept {
  double support = -kInfinity;
  for (const Vec2& v : polygon) support = std::max(support, u.dot(v));
  return support;
}

ConvexPolygon clip(const ConvexPolygon& polygon, const HalfPlane& half_plane, EdgeTags* tags,
                   std::uint8_t cut_tag) noexcept {
  ConvexPolygon out;
  EdgeTags out_tags{};
  // A vertex that finds no room is left out: the result stays convex and inside.
  const auto add = [&](const Vec2& v, std::uint8_t tag) {
    out_tags[std::min(out.size(), kMaxConvexVertices - 1)] = tag;
    (void)out.try_push_back(v);
  };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = next(polygon, i);
    const double da = half_plane.distance_m(a), db = half_plane.distance_m(b);
    const std::uint8_t tag = tags != nullptr ? (*tags)[i] : std::uint8_t{0};
    if (da >= 0.0) add(a, da == 0.0 && db < 0.0 ? cut_tag : tag);
    if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) add(a + (da / (da - db)) * (b - a), da > 0.0 ? cut_tag : tag);
  }
  if (out.size() < 3) out.clear();
  if (tags != nullptr) *tags = out_tags;
  return out;
}

ConvexPolygon intersection(const ConvexPolygon& a, const ConvexPolygon& b) noexcept {
  ConvexPolygon out = a;
  for (std::size_t i = 0; i < b.size() && !out.empty(); ++i) out = clip(out, edge_half_plane(b, i));
  if (b.size() < 3) out.clear();
  return out;
}

}  // namespace polygmap
