// SPDX-License-Identifier: Apache-2.0
// A mapped upright surface, plan view: a segment that rises from bottom to top.
#pragma once

#include <algorithm>
#include <limits>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/geometry/line.hpp"

namespace polygmap {

// Which uprights are in a foot's way, and which are a tread's own riser.
struct UprightParams {
  double facing_cos = 0.7;
  double aside_cos = 0.3;
  double leg_m = 0.5;
  double taller_m = 0.25;
  double below_m = 0.05;
  double overhang_max_m = 0.06;
  double overhang_tolerance_m = 0.02;
  double hidden_max_m = 0.10;

  static void visit(auto& p, auto& field) {
    field("facing_cos", p.facing_cos, 0.0, 1.0,
          "An upright surface that may be too high a rise faces the robot with a larger cosine.");
    field("aside_cos", p.aside_cos, 0.0, 1.0,
          "An upright surface that faces along the heading with a larger cosine is in no foot's way.");
    field("leg_m", p.leg_m, 0.0, 2.0, "What hangs higher above a tread is in no leg's way.");
    field("taller_m", p.taller_m, 0.0, 1.0,
          "A face at the nosing that ends no higher above the tread may be its own riser, which measures up to 0.09 m "
          "too tall.");
    field("below_m", p.below_m, 0.0, 0.5,
          "A face at the nosing that begins farther below the tread may be its own riser: what stands on the tread "
          "does not.");
    field("overhang_max_m", p.overhang_max_m, 0.0, 0.3, "A riser lies no farther behind the nosing of its tread.");
    field("overhang_tolerance_m", p.overhang_tolerance_m, 0.0, 0.1,
          "A riser's place against its nosing is taken with this tolerance, both ways.");
    field("hidden_max_m", p.hidden_max_m, 0.0, 0.3,
          "A tread whose nosing was not found is seen from no farther behind its riser on: a strip has no depth.");
  }
};

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
