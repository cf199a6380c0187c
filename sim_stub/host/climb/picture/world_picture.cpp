// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/picture/world_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "algorithms/geometry/convex.hpp"
#include "sim_stub/host/climb/route_report.hpp"

namespace polygmap::sim::svg {

void add_stairs_from_the_side(std::string& out, const View& view, const StairWorld& world, const Range& x_m,
                              double floor_bottom_m) {
  const auto at = [&view](double x, double z) { return Vec3(view.view_R_true.transpose() * Vec3(x, 0.0, z)); };
  std::vector<Vec3> profile_m{at(x_m.low, floor_bottom_m), at(x_m.low, 0.0)};
  double below_m = 0.0;
  for (const Step& s : world.steps) {
    if (!world.is_staircase) break;
    const double slab_m = std::min(kTreadSlab_m, s.height_m - below_m);
    profile_m.emplace_back(s.riser_x_m, 0, below_m);
    if (s.nosing_x_m < s.riser_x_m) {
      profile_m.emplace_back(s.riser_x_m, 0, s.height_m - slab_m);
      profile_m.emplace_back(s.nosing_x_m, 0, s.height_m - slab_m);
    }
    profile_m.emplace_back(s.nosing_x_m, 0, s.height_m);
    below_m = s.top_m(s.back_x_m, 0.0);
    if (s.turned()) profile_m.emplace_back(s.back_x_m, 0, below_m);
  }
  if (world.is_staircase && !world.steps.empty()) {
    profile_m.emplace_back(world.steps.back().back_x_m, 0, below_m);
    profile_m.emplace_back(world.steps.back().back_x_m, 0, 0);
  }
  profile_m.push_back(at(x_m.high, 0.0));
  profile_m.push_back(at(x_m.high, floor_bottom_m));
  std::string style;
  add(style, "fill=\"%s\" stroke=\"%s\" stroke-width=\"1.5\"", kStairFill, kStairLine);
  add_polygon(out, view, profile_m, style.c_str());
}

void add_stairs_from_above(std::string& out, const View& view, const StairWorld& world) {
  const double w = world.half_width_m;
  std::string style;
  add(style, "fill=\"%s\" stroke=\"%s\" stroke-width=\"1.2\"", kStairFill, kStairLine);
  for (const Step& s : world.steps) {
    if (!world.is_staircase) break;
    std::array<Vec3, 4> tread_m{{{s.nosing_x_m, -w, s.height_m},
                                 {s.back_x_m, -w, s.height_m},
                                 {s.back_x_m, w, s.height_m},
                                 {s.nosing_x_m, w, s.height_m}}};
    for (Vec3& corner_m : tread_m) corner_m = s.true_T_step * corner_m;
    add_polygon(out, view, tread_m, style.c_str());
  }
  for (const Obstacle& o : world.obstacles) {
    const Vec3 x{0.5 * o.size_m.x(), 0, 0}, y{0, 0.5 * o.size_m.y(), 0}, c = o.centre_m;
    const std::array<Vec3, 4> box_m{{c - x - y, c + x - y, c + x + y, c - x + y}};
    add_polygon(out, view, box_m, "fill=\"#857d70\" stroke=\"none\"");
  }
}

void add_step_numbers(std::string& out, const View& view, const StairWorld& world, bool from_the_side) {
  if (view.scale_pxpm < kLabelScale_pxpm || !world.is_staircase) return;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const Step& s = world.steps[k];
    const double drop_m = from_the_side ? 0.0 : world.half_width_m;
    const Vec3 front_m{s.riser_x_m, -drop_m, s.height_m};
    add_text(out, view.x_px(front_m) + 7.0, view.y_px(front_m) + (from_the_side ? 18.0 : -6.0), 11.0,
             "fill=\"#857d70\"", std::to_string(k + 1));
  }
}

namespace {

// Seen along one axis of the view.
std::vector<Vec3> outline_m(const View& view, const OrientedBox& box) {
  ConvexPolygon seen;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 corner{(i & 1U) != 0U ? 1.0 : -1.0, (i & 2U) != 0U ? 1.0 : -1.0, (i & 4U) != 0U ? 1.0 : -1.0};
    const Vec3 there_m = view.view_R_true * Vec3(box.centre * Vec3(corner.cwiseProduct(box.half_m)));
    static_cast<void>(seen.try_push_back(Vec2(there_m.x(), there_m[view.up])));
  }
  std::vector<Vec3> outline;
  for (const Vec2& corner : convex_hull(seen)) {
    Vec3 there_m{corner.x(), 0.0, 0.0};
    there_m[view.up] = corner.y();
    outline.push_back(view.view_R_true.transpose() * there_m);
  }
  return outline;
}

// How near its nearest point is to who looks from above, or from the right.
double nearness_m(const View& view, const OrientedBox& box) {
  const Vec3 axis = view.up == 1 ? Vec3::UnitZ() : Vec3(-view.view_R_true.row(1).transpose());
  return axis.dot(box.centre.p_m) + (box.centre.R.transpose() * axis).cwiseAbs().dot(box.half_m);
}

}  // namespace

void add_solids(std::string& out, const View& view, const StairWorld& world) {
  std::vector<const SolidBox*> solids;
  for (const SolidBox& solid : world.solids) solids.push_back(&solid);
  std::ranges::stable_sort(solids, {}, [&](const SolidBox* solid) { return nearness_m(view, solid->box()); });
  constexpr double kGlass = 0.2, kInTheWay = 0.5;
  for (const SolidBox* solid : solids) {
    const bool is_walkable = world.steps[static_cast<std::size_t>(solid->step)].is_walkable;
    std::string style;
    add(style, "fill=\"%s\" fill-opacity=\"%.2f\" stroke=\"%s\" stroke-width=\"1.2\"",
        is_walkable ? kStairFill : "#857d70", solid->is_glass ? kGlass : (is_walkable ? 1.0 : kInTheWay), kStairLine);
    add_polygon(out, view, outline_m(view, solid->box()), style.c_str());
  }
}

void add_places(std::string& out, const View& view, const WorldFile& file) {
  constexpr const char* kColour = "#b5179e";
  const auto mark = [&](const WorldPlace& place, double radius_m, const char* text) {
    const Vec3 p_m = file.world.point_m(place);
    const double x_px = view.x_px(p_m), y_px = view.y_px(p_m), reach_px = radius_m * view.scale_pxpm;
    if (view.up == 1) {
      add(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" fill=\"none\" stroke=\"%s\" stroke-dasharray=\"3 3\"/>\n",
          x_px, y_px, reach_px, kColour);
    } else {
      add(out, "<path d=\"M%.1f %.1fv-26\" stroke=\"%s\" stroke-width=\"1.6\"/>\n", x_px, y_px, kColour);
    }
    std::string style;
    add(style, "text-anchor=\"middle\" font-weight=\"600\" fill=\"%s\"", kColour);
    add_text(out, x_px, view.up == 1 ? y_px + reach_px + 13.0 : y_px - 30.0, 12.0, style.c_str(), text);
  };
  mark(file.start, 0.15, "start");
  if (file.world.goal) mark(*file.world.goal, RouteReport::kGoalWithin_m, "goal");
}

Mat3 view_turn(const WorldFile& file) {
  double yaw_rad = file.start.yaw_rad.value_or(0.0);
  constexpr double kNear_m = 0.5;
  if (file.world.goal) {
    const Vec2 way_m(file.world.goal->x_m - file.start.x_m, file.world.goal->y_m - file.start.y_m);
    if (way_m.norm() > kNear_m) yaw_rad = std::atan2(way_m.y(), way_m.x());
  }
  return rotation_z(-yaw_rad);
}

}  // namespace polygmap::sim::svg
