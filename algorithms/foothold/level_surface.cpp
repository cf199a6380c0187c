// SPDX-License-Identifier: Apache-2.0
#include "algorithms/foothold/level_surface.hpp"

#include <limits>

namespace polygmap {
namespace {

// How far a foot of that yaw reaches from its sole origin against the inward normal of an edge.
double reach_m(const SoleRectangle& foot, const Vec2& heading, const Vec2& inward) noexcept {
  const double ahead = inward.dot(heading);
  return std::max(-ahead * foot.toe_x_m, -ahead * foot.heel_x_m) + foot.half_width_m * std::abs(cross(heading, inward));
}

double least_m(const auto& limits, auto&& of) noexcept {
  double least_m = std::numeric_limits<double>::infinity();
  for (const FootLimit& limit : limits) least_m = std::min(least_m, of(limit));
  return least_m;
}

// Before the obstacles that a foot with its sole at p meets.
double before_obstacles_m(const LevelSurface& surface, const Vec2& p_m, double margins) noexcept {
  double least_m = std::numeric_limits<double>::infinity();
  const double lateral_m = surface.lateral_m(p_m), along_m = surface.along_m(p_m);
  for (const TreadObstacle& o : surface.obstacles) {
    if (o.meets(lateral_m, lateral_m)) least_m = std::min(least_m, o.sole_end_m - margins * o.margin_m - along_m);
  }
  return least_m;
}

// The ends that were seen, at the middle of their edges.
void note_ends(const SurfacePatch& surface, const LevelSurfaceParams& params, LevelSurface& out) noexcept {
  if (!out.has_nosing) return;
  const std::size_t n = surface.polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (surface.edges[i] != EdgeKind::kObserved) continue;
    const Vec2 a = surface.polygon[i].head<2>(), b = surface.polygon[i + 1 < n ? i + 1 : 0].head<2>();
    const double length_m = math::sqrt((b - a).squaredNorm());
    if (length_m < params.end_min_m) continue;
    const Vec2 middle_m = 0.5 * (a + b);
    const double turn = std::abs(out.heading.dot(b - a)) / length_m;  // cosine against the heading
    if (turn > params.end_parallel_cos) {
      (out.lateral_m(middle_m) > 0.0 ? out.ends.left_m : out.ends.right_m) = out.lateral_m(middle_m);
    } else if (turn < params.end_across_cos && out.along_m(middle_m) > params.end_min_m) {
      out.ends.far_m = out.along_m(middle_m);
    }
  }
}

// From the nosing's or the back line's direction; of a surface without either, the base's.
void find_heading(const SurfacePatch& surface, double base_yaw_rad, const Vec2& centre, const EdgeMargin& margin,
                  LevelSurface& out) noexcept {
  out.has_nosing = surface.nosing.valid;
  const EdgeLine& line = surface.nosing.valid ? surface.nosing : surface.back;
  out.yaw_rad = base_yaw_rad;
  if (line.valid) {
    const Vec2 along = (line.b_m - line.a_m).head<2>();
    const double into = (out.has_nosing ? 1.0 : -1.0) * cross(along, centre - line.a_m.head<2>());
    const Vec2 heading = into >= 0.0 ? left_of(along) : Vec2{-left_of(along)};
    out.yaw_rad = math::atan2(heading.y(), heading.x());
  }
  out.heading = unit_at(out.yaw_rad);
  out.left = left_of(out.heading);
  if (out.has_nosing) {
    const bool a_is_left = out.left.dot((surface.nosing.a_m - surface.nosing.b_m).head<2>()) > 0.0;
    out.nosing_a_m = a_is_left ? surface.nosing.a_m : surface.nosing.b_m;
    out.nosing_b_m = a_is_left ? surface.nosing.b_m : surface.nosing.a_m;
    out.nosing_margin_m = margin.of(surface.nosing.sigma_m);
  }
}

void find_lip(const SurfacePatch& surface, const Vec2& centre, LevelSurface& out) noexcept {
  if (!surface.back.valid || !surface.back_drops) return;
  const EdgeLine& line = surface.back;
  const Vec2 along = (line.b_m - line.a_m).head<2>();
  const double length_m = along.norm();
  if (!(length_m > 0.0)) return;
  const bool a_is_left = cross(along, centre - line.a_m.head<2>()) < 0.0;  // the surface lies behind
  Lip& lip = out.ends.lip.emplace();
  lip.left_m = a_is_left ? line.a_m : line.b_m;
  lip.right_m = a_is_left ? line.b_m : line.a_m;
  lip.heading = left_of((lip.right_m - lip.left_m).head<2>() / length_m);
  lip.sigma_m = line.sigma_m;
}

// Contact rectangle to every edge, collision box to a back line that rises.
void add_edge_limits(const SurfacePatch& surface, const LevelSurfaceParams& params, const EdgeMargin& margin,
                     const SoleModel& sole, LevelSurface& out) noexcept {
  for (std::size_t i = 0; i < out.hull.size(); ++i) {
    const HalfPlane inside = edge_half_plane(out.hull, i);
    const double facing = inside.inward.dot(out.heading);
    double margin_m = margin.least_m;  // the sides keep one of their own
    if (facing > params.square_cos && surface.nosing.valid) margin_m = out.nosing_margin_m;
    if (facing < -params.square_cos && surface.back.valid) margin_m = out.back_margin_m;
    const bool is_side = std::abs(inside.inward.dot(out.left)) > params.side_sin;
    const FootLimit limit{inside, reach_m(sole.contact, out.heading, inside.inward), margin_m, is_side};
    if (out.ends.below && facing > params.square_cos) {
      (void)out.ends.below->hidden.try_push_back(limit);
    } else {
      (void)out.edges.try_push_back(limit);
    }
  }
  if (out.has_nosing && surface.back.valid && !surface.back_drops) {
    const std::optional<Line2> back = line_through(surface.back.a_m.head<2>(), surface.back.b_m.head<2>());
    if (back)
      add_toe_limit(out, params, sole, *back, out.back_margin_m, {0.0, std::numeric_limits<double>::infinity()});
  }
}

// Eqs (14)-(16); false without an area.
bool find_outline(const MapPolygon& polygon, LevelSurface& out) noexcept {
  const SurfacePatch& surface = polygon.surface;
  out = {};
  out.id = polygon.id;
  out.last_seen_ns = polygon.last_seen_ns;
  out.plane = {surface.normal, surface.d_m};
  ConvexPolygon plan;  // eq. (14): z = 0
  for (const Vec3& v : surface.polygon) (void)plan.try_push_back(v.head<2>());
  out.hull = convex_hull(plan);
  out.box = bounding_box(out.hull);
  return area_m2(out.hull) > 0.0 && std::abs(surface.normal.z()) > 0.5;
}

}  // namespace

double LevelSurface::contact_clearance_m(const Vec2& p_m) const noexcept {
  return least_m(edges, [&](const FootLimit& limit) { return limit.clearance_m(p_m); });
}
double LevelSurface::toe_clearance_m(const Vec2& p_m) const noexcept {
  return std::min(least_m(toe, [&](const FootLimit& limit) { return limit.clearance_m(p_m); }),
                  before_obstacles_m(*this, p_m, 0.0));
}
double LevelSurface::spare_m(const Vec2& p_m) const noexcept {
  const auto of = [&](const FootLimit& limit) { return limit.spare_m(p_m); };
  return std::min({least_m(edges, of), least_m(toe, of), before_obstacles_m(*this, p_m, 1.0)});
}

bool prepare(const MapPolygon& polygon, double base_yaw_rad, const LevelSurfaceParams& params, const EdgeMargin& margin,
             const SoleModel& sole, LevelSurface& out) noexcept {
  if (!find_outline(polygon, out)) return false;
  const SurfacePatch& surface = polygon.surface;
  const Vec2 centre = centroid_m(out.hull);
  find_heading(surface, base_yaw_rad, centre, margin, out);
  find_lip(surface, centre, out);
  out.back_margin_m = surface.back.valid ? margin.of(surface.back.sigma_m) : out.nosing_margin_m;
  out.height_m = out.plane.height_m(out.has_nosing ? out.nosing_middle_m() : centre);

  note_ends(surface, params, out);
  add_edge_limits(surface, params, margin, sole, out);
  return true;
}

bool prepare_below(const MapPolygon& polygon, const Lip& lip, const LevelSurfaceParams& params,
                   const EdgeMargin& margin, const SoleModel& sole, LevelSurface& out) noexcept {
  if (!find_outline(polygon, out)) return false;
  const SurfacePatch& surface = polygon.surface;
  find_lip(surface, centroid_m(out.hull), out);
  // On a wedge the foot stands between the headings of both its edges.
  const bool is_wedge = out.ends.lip && out.ends.lip->heading.dot(lip.heading) > params.square_cos;
  out.heading = is_wedge ? Vec2{(lip.heading + out.ends.lip->heading).normalized()} : lip.heading;
  out.yaw_rad = math::atan2(out.heading.y(), out.heading.x());
  out.left = left_of(out.heading);
  out.has_nosing = true;
  out.ends.below.emplace();
  out.nosing_a_m = lip.left_m;
  out.nosing_b_m = lip.right_m;
  for (Vec3* end_m : {&out.nosing_a_m, &out.nosing_b_m}) end_m->z() = out.plane.height_m(end_m->head<2>());
  const double margin_m = margin.of(lip.sigma_m);
  out.nosing_margin_m = margin_m + sole.contact.heel_x_m - sole.collision.heel_x_m;
  out.back_margin_m = surface.back.valid ? margin.of(surface.back.sigma_m) : out.nosing_margin_m;
  out.height_m = out.plane.height_m(out.nosing_middle_m());

  note_ends(surface, params, out);
  if (out.ends.lip) out.depth_m = out.along_m(out.ends.lip->middle_m());
  add_edge_limits(surface, params, margin, sole, out);
  const auto limit = [&](const SoleRectangle& foot, const Vec2& inward, const Vec3& at_m, double kept_m, bool side) {
    (void)out.edges.try_push_back(
        {{inward, inward.dot(at_m.head<2>())}, reach_m(foot, out.heading, inward), kept_m, side});
  };
  limit(sole.collision, lip.heading, lip.left_m, margin_m, false);
  // The feet come from where the upper surface was seen.
  const Vec2 left = left_of(lip.heading);
  limit(sole.contact, -left, lip.left_m, margin.least_m, true);
  limit(sole.contact, left, lip.right_m, margin.least_m, true);
  return true;
}

void add_toe_limit(LevelSurface& surface, const LevelSurfaceParams& params, const SoleModel& sole, const Line2& line,
                   double margin_m, const Interval& behind) noexcept {
  const auto& [point_m, direction] = line;
  const double across = direction.dot(surface.left);
  if (std::abs(across) < params.square_cos) return;
  // Where it crosses the middle of the surface.
  const Vec2 d = direction / across;
  const double depth_m = surface.along_m(point_m - surface.lateral_m(point_m) * d);
  if (!(depth_m > behind.min_m) || !(depth_m < behind.max_m)) return;
  const Vec2 inward = -left_of(direction) * (left_of(direction).dot(surface.heading) > 0.0 ? 1.0 : -1.0);
  const FootLimit limit{
      {inward, inward.dot(point_m)}, reach_m(sole.collision, surface.heading, inward), margin_m, false};
  if (!surface.toe.try_push_back(limit)) {  // keep the nearest
    FootLimit* farthest = surface.toe.begin();
    const Vec2 middle = surface.nosing_middle_m();
    for (FootLimit& t : surface.toe) {
      if (t.clearance_m(middle) > farthest->clearance_m(middle)) farthest = &t;
    }
    if (farthest->clearance_m(middle) > limit.clearance_m(middle)) *farthest = limit;
  }
  if (surface.depth_m == 0.0 || depth_m < surface.depth_m) surface.depth_m = depth_m;
}

void add_obstacle(LevelSurface& surface, const TreadObstacle& obstacle, double middle_m) noexcept {
  if (surface.obstacles.try_push_back(obstacle)) return;
  const auto aside_m = [middle_m](const TreadObstacle& o) {
    return std::max(o.sole_lateral_m.min_m - middle_m, middle_m - o.sole_lateral_m.max_m);
  };
  TreadObstacle* farthest = surface.obstacles.begin();
  for (TreadObstacle& o : surface.obstacles) {
    if (aside_m(o) > aside_m(*farthest)) farthest = &o;
  }
  if (aside_m(*farthest) > aside_m(obstacle)) *farthest = obstacle;
}

}  // namespace polygmap
