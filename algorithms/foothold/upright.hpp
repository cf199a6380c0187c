// SPDX-License-Identifier: Apache-2.0
// A mapped upright surface, plan view: a segment that rises from bottom to top.
#pragma once

#include <algorithm>
#include <limits>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/geometry/line.hpp"

namespace polygmap {

struct Upright {
  Vec2 point_m, direction, outward;
  double reach_left_m = 0.0, reach_right_m = 0.0;  // along direction from the point
  double bottom_m = std::numeric_limits<double>::infinity();
  double top_m = -std::numeric_limits<double>::infinity();
  double sigma_m = 0.0;  // of its place along outward

  [[nodiscard]] double width_m() const noexcept { return reach_left_m - reach_right_m; }
  [[nodiscard]] Vec2 left_m() const noexcept { return point_m + reach_left_m * direction; }
  [[nodiscard]] Vec2 right_m() const noexcept { return point_m + reach_right_m * direction; }
};

[[nodiscard]] inline Upright upright_of(const SurfacePatch& surface) noexcept {
  Upright out;
  out.point_m = surface.centroid_m.head<2>();
  out.outward = surface.normal.head<2>().normalized();
  out.direction = left_of(out.outward);
  out.sigma_m = surface.offset_sigma_m;
  for (const Vec3& v : surface.polygon) {
    const double along_m = out.direction.dot(v.head<2>() - out.point_m);
    out.reach_left_m = std::max(out.reach_left_m, along_m);
    out.reach_right_m = std::min(out.reach_right_m, along_m);
    out.bottom_m = std::min(out.bottom_m, v.z());
    out.top_m = std::max(out.top_m, v.z());
  }
  return out;
}

}  // namespace polygmap
