// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/map_track.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <limits>

namespace polygmap {

double TrackedLine::variance_m2(double y_m) const noexcept {
  const double det = information.determinant();
  if (!(det > 0.0)) return std::numeric_limits<double>::infinity();
  return (information(1, 1) - 2.0 * y_m * information(0, 1) + y_m * y_m * information(0, 0)) / det;
}

Mat3 frame_from(const Vec3& normal, const Vec3& x_hint) noexcept {
  Vec3 x = x_hint - normal.dot(x_hint) * normal;
  if (!(x.squaredNorm() > 1e-8)) x = normal.unitOrthogonal();
  x.normalize();
  Mat3 R;
  R << x, normal.cross(x), normal;
  return R;
}

bool end_observed(const SeenEndParams& params, const ConvexPolygon& polygon,
                  const std::array<EdgeKind, kMaxPolygonVertices>& edges, const Vec2& u, double support) noexcept {
  const std::size_t n = polygon.size();
  double observed_m = 0.0, unknown_m = 0.0;
  std::size_t corner = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = polygon[i + 1 == n ? 0 : i + 1];
    if (u.dot(a) > u.dot(polygon[corner])) corner = i;
    if (u.dot(a) < support - params.tolerance_m || u.dot(b) < support - params.tolerance_m) continue;
    (edges[i] == EdgeKind::kObserved ? observed_m : unknown_m) += math::sqrt((b - a).squaredNorm());
  }
  if (observed_m + unknown_m > params.min_length_m) return observed_m > unknown_m;
  return edges[corner] == EdgeKind::kObserved && edges[corner == 0 ? n - 1 : corner - 1] == EdgeKind::kObserved;
}

}  // namespace polygmap
