// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/kinds/builder.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {
namespace {

constexpr double kBelowFloor_m = 0.2;  // that nothing is pushed out downwards

PlannedPlace place_of(const Frame& at, const std::string& surface) {
  return {at.p_m.x(), at.p_m.y(), at.yaw_deg, surface};
}

}  // namespace

PlannedSolid& WorldBuilder::box(const Frame& at, const std::string& name, const Vec3& centre_m, const Vec3& size_m,
                                double roll_deg, double pitch_deg) {
  plan_.solids.push_back({name, at.at(centre_m), size_m, Vec3(roll_deg, pitch_deg, at.yaw_deg)});
  return plan_.solids.back();
}

PlannedSolid& WorldBuilder::block(const Frame& edge, const std::string& name, double length_m, double width_m,
                                  double thickness_m, const Tilt& tilt) {
  const double height_m = thickness_m > 0.0 ? thickness_m : edge.p_m.z() + kBelowFloor_m;
  const Vec3 up = rotation_zyx(0.0, tilt.pitch_deg * kPi / 180.0, tilt.roll_deg * kPi / 180.0).col(2);
  return box(edge, name, Vec3(0.5 * length_m, 0.0, 0.0) - 0.5 * height_m * up, Vec3(length_m, width_m, height_m),
             tilt.roll_deg, tilt.pitch_deg);
}

void WorldBuilder::tread(const Frame& edge, const std::string& name, double length_m, const TreadStyle& style,
                         const Tilt& tilt) {
  const bool is_open = style.slab_m > 0.0;
  if (!is_open && !(style.nosing_m > 0.0)) {
    block(edge, name, length_m, style.width_m, 0.0, tilt);
    return;
  }
  const double slab_m = is_open ? style.slab_m : kTreadSlab_m;
  if (!is_open) block(edge.ahead(0.0, 0.0, -slab_m), "below " + name, length_m, style.width_m, 0.0, tilt);
  block(edge.ahead(-style.nosing_m), name, length_m + style.nosing_m, style.width_m, slab_m, tilt);
}

PlannedSolid& WorldBuilder::thing(const Frame& foot, const std::string& name, const Vec3& size_m) {
  PlannedSolid& solid = box(foot, name, Vec3(0.0, 0.0, 0.5 * size_m.z()), size_m);
  solid.is_walkable = false;
  return solid;
}

void WorldBuilder::bar(const Vec3& from_m, const Vec3& to_m, const std::string& name, double side_m) {
  const Vec3 along_m = to_m - from_m;
  const double yaw_rad = std::atan2(along_m.y(), along_m.x()), level_m = along_m.head<2>().norm();
  const Frame middle{0.5 * (from_m + to_m), yaw_rad * 180.0 / kPi};
  const double pitch_deg = -std::atan2(along_m.z(), level_m) * 180.0 / kPi;
  box(middle, name, Vec3::Zero(), Vec3(along_m.norm(), side_m, side_m), 0.0, pitch_deg).is_walkable = false;
}

void WorldBuilder::start(const Frame& at, const std::string& surface) { plan_.start = place_of(at, surface); }
void WorldBuilder::goal(const Frame& at, const std::string& surface) {
  plan_.goal = place_of(at, surface);
  plan_.goal->yaw_deg.reset();  // whichever way it looks then
}
void WorldBuilder::way(const Frame& at, const std::string& surface) {
  way_of_foot(at, Foot::kLeft, surface);
  way_of_foot(at, Foot::kRight, surface);
}
void WorldBuilder::way_of_foot(const Frame& at, Foot foot, const std::string& surface) {
  const double aside_m = side_sign(foot) * nominal_robot().stance.half_width_m;
  plan_.way.push_back(place_of(at.ahead(0.0, aside_m), surface));
}

WorldPlan WorldBuilder::take(const std::string& what) {
  plan_.what = what;
  return std::move(plan_);
}

std::string metres(double value_m) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3g", value_m);
  return buffer;
}

}  // namespace polygmap::sim
