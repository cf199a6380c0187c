// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/tops.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "algorithms/geometry/convex.hpp"

namespace polygmap::sim {
namespace {

// Of a step's top, as much larger.
ConvexPolygon outline_of(const Step& step, double larger_m) {
  StaticVector<Vec2, 4> corners;
  const double x_m = step.back_x_m + larger_m, y_m = step.half_width_m + larger_m;
  for (const auto& [x, y] : {std::pair{x_m, y_m}, {-x_m, y_m}, {-x_m, -y_m}, {x_m, -y_m}}) {
    static_cast<void>(corners.try_push_back((step.true_T_step * Vec3(x, y, 0.0)).head<2>()));
  }
  ConvexPolygon outline;
  for (const Vec2& corner : convex_hull(corners)) static_cast<void>(outline.try_push_back(corner));
  return outline;
}

bool touch_as_one(const Step& a, const Step& b) {
  constexpr double kParallel = 0.99995;  // cosine: 10 mrad
  if (a.true_T_step.R.col(2).dot(b.true_T_step.R.col(2)) < kParallel) return false;
  const ConvexPolygon shared = intersection(outline_of(a, 0.5 * kSlit_m), outline_of(b, 0.5 * kSlit_m));
  return std::ranges::any_of(shared, [&](const Vec2& p_m) {
    return std::abs(a.top_m(p_m.x(), p_m.y()) - b.top_m(p_m.x(), p_m.y())) <= kSameTop_m;
  });
}

// The contact rectangle, larger by so much on every side.
ConvexPolygon rectangle_of(const Transform& true_T_sole, const SoleModel& sole, double larger_m) {
  constexpr int kDirections = 8;
  StaticVector<Vec2, 4 * kDirections> corners;
  for (const double x_m : {sole.contact.toe_x_m, sole.contact.heel_x_m}) {
    for (const double y_m : {sole.contact.half_width_m, -sole.contact.half_width_m}) {
      const Vec2 corner_m = (true_T_sole * Vec3(x_m, y_m, 0.0)).head<2>();
      for (int i = 0; i < kDirections; ++i) {
        const double yaw_rad = yaw_of(true_T_sole.R) + 2.0 * kPi * i / kDirections;
        static_cast<void>(corners.try_push_back(corner_m + larger_m * unit_at(yaw_rad)));
      }
    }
  }
  ConvexPolygon grown;
  for (const Vec2& corner : convex_hull(corners)) static_cast<void>(grown.try_push_back(corner));
  return grown;
}

// What of it lies on none of the tops.
std::vector<ConvexPolygon> bare_parts(const ConvexPolygon& whole, std::span<const ConvexPolygon> tops) {
  constexpr double kNothing_m2 = 1e-9;
  std::vector<ConvexPolygon> bare{whole};
  for (const ConvexPolygon& top : tops) {
    std::vector<ConvexPolygon> left;
    for (ConvexPolygon piece : bare) {
      for (std::size_t i = 0; i < top.size() && area_m2(piece) > kNothing_m2; ++i) {
        const HalfPlane inside = edge_half_plane(top, i);
        const ConvexPolygon beyond = clip(piece, {-inside.inward, -inside.offset_m});
        if (area_m2(beyond) > kNothing_m2) left.push_back(beyond);
        piece = clip(piece, inside);
      }
    }
    bare = std::move(left);
  }
  return bare;
}

double beyond_m(std::span<const ConvexPolygon> bare, std::span<const ConvexPolygon> tops) {
  double most_m = 0.0;
  for (const ConvexPolygon& part : bare) {
    const auto look = [&](const Vec2& p_m) {
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const ConvexPolygon& top : tops) nearest_m = std::min(nearest_m, -signed_distance_m(top, p_m));
      most_m = std::max(most_m, nearest_m);
    };
    for (const Vec2& corner_m : part) look(corner_m);
    look(centroid_m(part));
  }
  return most_m;
}

}  // namespace

void group_tops(StairWorld& world) {
  std::vector<Step>& steps = world.steps;
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i].group = static_cast<int>(i);
  const auto join = [&steps](int from, int to) {
    for (Step& step : steps) {
      if (step.group == from) step.group = to;
    }
  };
  for (std::size_t i = 0; i < steps.size(); ++i) {
    for (std::size_t k = 0; k < i && steps[i].is_walkable; ++k) {
      if (steps[k].is_walkable && touch_as_one(steps[i], steps[k])) join(steps[i].group, steps[k].group);
    }
  }
  for (const Step& step : steps) {
    const Vec3 reach_m = step.true_T_step.R.cwiseAbs() * Vec3(step.back_x_m, step.half_width_m, 0.0);
    const bool on_floor = std::abs(step.true_T_step.p_m.z()) + reach_m.z() <= kSameTop_m;
    if (step.is_walkable && on_floor) join(step.group, kFloorStep);
  }
}

double margin_on_tops_m(const Transform& true_T_sole, const StairWorld& world, int step, const SoleModel& sole) {
  if (world.are_one(step, kFloorStep)) return std::numeric_limits<double>::infinity();
  const Vec3& at_m = true_T_sole.p_m;
  const double height_m = world.steps[static_cast<std::size_t>(step)].top_m(at_m.x(), at_m.y());
  std::vector<ConvexPolygon> tops;
  for (const Step& top : world.steps) {  // who stands across a gap stands on both its sides
    if (top.is_walkable && std::abs(top.top_m(at_m.x(), at_m.y()) - height_m) <= kSameTop_m) {
      tops.push_back(outline_of(top, 0.5 * kSlit_m));
    }
  }
  const std::vector<ConvexPolygon> bare = bare_parts(rectangle_of(true_T_sole, sole, 0.0), tops);
  if (!bare.empty()) return -beyond_m(bare, tops) - 0.5 * kSlit_m;
  constexpr double kFine_m = 1e-4;
  double least_m = 0.0, most_m = kMostMargin_m;
  while (most_m - least_m > kFine_m) {
    const double middle_m = 0.5 * (least_m + most_m);
    (bare_parts(rectangle_of(true_T_sole, sole, middle_m), tops).empty() ? least_m : most_m) = middle_m;
  }
  return 0.5 * (least_m + most_m) - 0.5 * kSlit_m;
}

namespace {

// From where to where a line from a point on is inside an outline; the first is beyond the second where it is nowhere.
struct Crossing {
  double enters_m = -std::numeric_limits<double>::infinity(), leaves_m = std::numeric_limits<double>::infinity();
};
Crossing crossing_of(const ConvexPolygon& outline, const Vec2& from_m, const Vec2& direction) {
  Crossing crossing;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const HalfPlane inside = edge_half_plane(outline, k);
    const double inward = inside.inward.dot(direction), depth_m = inside.distance_m(from_m);
    if (std::abs(inward) < 1e-12) {
      if (depth_m < 0.0) crossing.leaves_m = -std::numeric_limits<double>::infinity();
    } else if (inward < 0.0) {
      crossing.leaves_m = std::min(crossing.leaves_m, -depth_m / inward);
    } else {
      crossing.enters_m = std::max(crossing.enters_m, -depth_m / inward);
    }
  }
  return crossing;
}

}  // namespace

double edge_behind_m(const Vec3& point_m, double yaw_rad, const StairWorld& world, int step) {
  if (world.are_one(step, kFloorStep)) return std::numeric_limits<double>::quiet_NaN();
  const Vec2 back = -unit_at(yaw_rad), from_m = point_m.head<2>();
  const auto crossing = [&](const Step& top) { return crossing_of(outline_of(top, 0.5 * kSlit_m), from_m, back); };
  double way_m = 0.0;
  for (std::size_t round = 0; round < world.steps.size(); ++round) {  // each top may lead on to the next one
    const double before_m = way_m;
    for (std::size_t i = 0; i < world.steps.size(); ++i) {
      if (!world.are_one(step, static_cast<int>(i))) continue;
      const Crossing of_top = crossing(world.steps[i]);
      if (of_top.enters_m <= way_m + kSlit_m) way_m = std::max(way_m, of_top.leaves_m);
    }
    if (way_m == before_m) break;
  }
  // The last part may lie below the nosing of the next tread, where no foot fits and no camera looks.
  constexpr double kHigher_m = 0.02, kNextTread_m = 0.35;
  for (std::size_t i = 0; i < world.steps.size(); ++i) {
    const Step& next = world.steps[i];
    const double higher_m = next.true_T_step.p_m.z() - point_m.z();
    if (!next.is_walkable || higher_m < kHigher_m || higher_m > kNextTread_m) continue;
    const Crossing above = crossing(next);
    if (above.enters_m >= 0.0 && above.enters_m < above.leaves_m) way_m = std::min(way_m, above.enters_m + kSlit_m);
  }
  return way_m - 0.5 * kSlit_m;
}

}  // namespace polygmap::sim
