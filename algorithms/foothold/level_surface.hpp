// SPDX-License-Identifier: Apache-2.0
// A mapped level surface prepared for the foothold search, and how a foot lies on it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/geometry/convex.hpp"
#include "algorithms/geometry/plane.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

// What a foot keeps from an edge: where the edge is and where the foot lands err independently.
struct EdgeMargin {
  double least_m = 0.0;
  double sigmas = 0.0;
  double landing_sigma_m = 0.0;
  [[nodiscard]] double of(double edge_sigma_m) const noexcept {
    return std::max(least_m, sigmas * math::sqrt(math::square(edge_sigma_m) + math::square(landing_sigma_m)));
  }

  static void visit(auto& p, auto& field) {
    field("least_m", p.least_m, 0.0, 0.1, "The margin at least.");
    field("sigmas", p.sigmas, 0.0, 10.0, "The margin is as many sigmas of where edge and foot are.");
    field("landing_sigma_m", p.landing_sigma_m, 0.0, 0.1, "A foot lands this far off, one sigma.");
  }
};

// How a surface's edges and the lines behind it are read. Cosines and sines are of turns in plan.
struct LevelSurfaceParams {
  double square_cos = 0.866;  // 30 degrees
  double side_sin = 0.2;
  double end_parallel_cos = 0.95, end_across_cos = 0.2;
  double end_min_m = 0.08;

  static void visit(auto& p, auto& field) {
    field("square_cos", p.square_cos, 0.5, 1.0,
          "A line whose turn against the nosing has a larger cosine lies across the stairs: a front, a back, a riser "
          "that ends a tread.");
    field("side_sin", p.side_sin, 0.0, 1.0,
          "An edge whose turn against the nosing has a larger sine bounds the tread to the side.");
    field("end_parallel_cos", p.end_parallel_cos, 0.5, 1.0,
          "An observed edge whose turn against the heading has a larger cosine is a side end of the tread.");
    field("end_across_cos", p.end_across_cos, 0.0, 0.5,
          "An observed edge whose turn against the heading has a smaller cosine is the tread's far end.");
    field("end_min_m", p.end_min_m, 0.0, 1.0,
          "A shorter observed edge, or a far end nearer to the nosing, is no end of a tread.");
  }
};

// A foot on the surface has its yaw, so each edge takes the same part of every foot: what is left of the edge's
// distance to the sole's origin is distance - reach. Plan view, in the map.
struct FootLimit {
  HalfPlane inside;
  double reach_m = 0.0;   // from the sole's origin towards the edge
  double margin_m = 0.0;  // to be kept
  bool side = false;      // bounds the surface to the left or right
  [[nodiscard]] double clearance_m(const Vec2& sole_p_m) const noexcept {
    return inside.distance_m(sole_p_m) - reach_m;
  }
  // Beyond the margin.
  [[nodiscard]] double spare_m(const Vec2& sole_p_m) const noexcept { return clearance_m(sole_p_m) - margin_m; }
};

// What rises from the surface, or before it, and does not reach across both feet: they may stand beside it.
struct TreadObstacle {
  double sole_end_m = 0.0;  // behind the nosing, of a sole whose toe touches it
  double margin_m = 0.0;    // to be kept before it
  Interval sole_lateral_m;  // left of the nosing's middle, of soles that meet it or the margin beside it
  bool low = false;         // it may lie between the feet, below the legs
  [[nodiscard]] bool meets(double right_m, double left_m) const noexcept {
    return sole_lateral_m.min_m < left_m && sole_lateral_m.max_m > right_m;
  }
  // Of the soles of two feet.
  [[nodiscard]] bool meets_feet(double right_m, double left_m) const noexcept {
    return low ? meets(right_m, right_m) || meets(left_m, left_m) : meets(right_m, left_m);
  }
};

// Where a surface drops away ahead. Plan view, in the map.
struct Lip {
  Vec3 left_m = Vec3::Zero();  // its ends, looking out over it
  Vec3 right_m = Vec3::Zero();
  Vec2 heading = Vec2::UnitX();  // out over it
  double sigma_m = 0.0;
  [[nodiscard]] Vec2 middle_m() const noexcept { return 0.5 * (left_m + right_m).head<2>(); }
};

struct BelowLip {
  StaticVector<FootLimit, kMaxPolygonVertices> hidden;  // near edges, which the lip hides from farther off
};

// Where they were seen: lateral places of a tread's sides, and how far behind the nosing it ends, in a riser or in
// nothing.
struct SeenEnds {
  std::optional<double> left_m, right_m, far_m;
  std::optional<BelowLip> below;  // what is the nosing is the lip above it
  std::optional<Lip> lip;         // the far one, where it drops
};

struct LevelSurface {
  std::uint32_t id = 0;
  std::int64_t last_seen_ns = 0;
  Plane plane;
  ConvexPolygon hull;     // eqs 14, 15: the plan view
  BoundingBox box;        // eq. 16
  double height_m = 0.0;  // at the nosing's middle, else at the centroid
  bool has_nosing = false;
  double yaw_rad = 0.0;  // up the stairs
  Vec2 heading = Vec2::UnitX();
  Vec2 left = Vec2::UnitY();
  Vec3 nosing_a_m = Vec3::Zero();  // left end
  Vec3 nosing_b_m = Vec3::Zero();
  double nosing_margin_m = 0.0;
  double back_margin_m = 0.0;  // of the nosing where there is no back line
  // Contact rectangle to its edges; of a surface below a lip, collision box to that and contact rectangle to its ends.
  StaticVector<FootLimit, kMaxPolygonVertices + 3> edges;
  StaticVector<FootLimit, 3> toe;  // collision box to back edge, next nosing, next riser
  double depth_m = 0.0;            // nosing to the nearest of these, 0: none
  double rise_behind_m = 0.0;      // to the nearest tread that rises behind it, 0: none
  StaticVector<TreadObstacle, 8> obstacles;
  SeenEnds ends;

  [[nodiscard]] Vec2 nosing_middle_m() const noexcept { return 0.5 * (nosing_a_m + nosing_b_m).head<2>(); }
  // Sole origin at a distance behind the nosing and to the left of its middle.
  [[nodiscard]] Vec2 at(double along_m, double lateral_m) const noexcept {
    return nosing_middle_m() + along_m * heading + lateral_m * left;
  }
  [[nodiscard]] double lateral_m(const Vec2& p_m) const noexcept { return left.dot(p_m - nosing_middle_m()); }
  [[nodiscard]] double along_m(const Vec2& p_m) const noexcept { return heading.dot(p_m - nosing_middle_m()); }

  // Signed: least distance from the contact rectangle of a sole at p to the surface's edges, eq. (25).
  [[nodiscard]] double contact_clearance_m(const Vec2& p_m) const noexcept;
  // Signed: collision box to what rises behind the surface; +inf when nothing is mapped.
  [[nodiscard]] double toe_clearance_m(const Vec2& p_m) const noexcept;
  // Signed: least of both beyond the margins.
  [[nodiscard]] double spare_m(const Vec2& p_m) const noexcept;
};

// Eqs (14)-(16) and the foot limits of the edges; base_yaw_rad is the heading of surfaces without a nosing. False when
// the polygon has no area.
[[nodiscard]] bool prepare(const MapPolygon& polygon, double base_yaw_rad, const LevelSurfaceParams& params,
                           const EdgeMargin& margin, const SoleModel& sole, LevelSurface& out) noexcept;

// The same of a surface below a lip, for feet that come down over it: what a nosing is to a tread that is climbed, the
// lip is to this one, since no heel may touch it.
[[nodiscard]] bool prepare_below(const MapPolygon& polygon, const Lip& lip, const LevelSurfaceParams& params,
                                 const EdgeMargin& margin, const SoleModel& sole, LevelSurface& out) noexcept;

// Adds something that the collision box must not reach: a line in plan that rises behind the surface, through point_m
// along the unit vector direction. Ignored unless it lies across the stairs, by params.square_cos, and between
// behind.min_m and behind.max_m behind the nosing.
void add_toe_limit(LevelSurface& surface, const LevelSurfaceParams& params, const SoleModel& sole, const Line2& line,
                   double margin_m, const Interval& behind) noexcept;

// Adds an obstacle; those farthest to the side of middle_m give way when there are too many.
void add_obstacle(LevelSurface& surface, const TreadObstacle& obstacle, double middle_m) noexcept;

}  // namespace polygmap
