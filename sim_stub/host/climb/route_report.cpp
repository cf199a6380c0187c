// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/route_report.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace polygmap::sim {
namespace {

constexpr std::uint64_t kBodyEvery_ticks = 10;

// A shank without its lowest part, which is as near to the ground as the foot is.
Capsule above_the_foot(const Capsule& shank) {
  constexpr double kFoot_m = 0.1;
  Capsule upper = shank;
  Vec3& low_m = upper.a_m.z() < upper.b_m.z() ? upper.a_m : upper.b_m;
  const Vec3& high_m = upper.a_m.z() < upper.b_m.z() ? upper.b_m : upper.a_m;
  low_m += std::min(kFoot_m, (high_m - low_m).norm()) * (high_m - low_m).normalized();
  return upper;
}

// Its radius apart.
OrientedBox core_of(const Capsule& capsule) {
  const Vec3 along_m = capsule.b_m - capsule.a_m;
  const Mat3 R = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), along_m).toRotationMatrix();
  return {{R, 0.5 * (capsule.a_m + capsule.b_m)}, Vec3(0.0, 0.0, 0.5 * along_m.norm())};
}

}  // namespace

void RouteReport::observe(const Truth& truth) {
  last_ = truth;
  if (ticks_++ % kBodyEvery_ticks == 0) observe_body(truth);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (!truth.in_contact[foot]) {
      stands_since_ns_[foot] = -1;
      continue;
    }
    if (stands_since_ns_[foot] < 0) stands_since_ns_[foot] = truth.stamp_ns;
    if (truth.stamp_ns - stands_since_ns_[foot] < kRest_ns) continue;
    const int step = truth.step_index[foot];
    // A sole across two tops that are one stays where it is; so does the list while both feet come to one surface.
    int& rests_on = rests_on_[foot];
    if (rests_on != kNowhere && world_.are_one(rests_on, step)) continue;
    rests_on = step;
    if (!stood_on_.empty() && world_.are_one(stood_on_.back(), step)) continue;
    if (!stood_on_.empty()) last_came_ns_ = truth.stamp_ns;
    if (stood_on_.size() == 1) first_came_ns_ = last_came_ns_;
    stood_on_.push_back(step);
  }
}

void RouteReport::observe_body(const Truth& truth) {
  const auto look = [this](OrientedBox part, const Transform& true_T_part, double radius_m) {
    part.centre = true_T_part * part.centre;
    const double least_m = clearance_m(part, solids_, std::array{kFloorStep}, body_clearance_m_ + radius_m) - radius_m;
    body_clearance_m_ = std::min(body_clearance_m_, least_m);
  };
  look({{Mat3::Identity(), nominal_robot().masses.torso.centre_m}, torso_half_m()}, truth.true_T_base, 0.0);
  for (const LegShapes& leg : truth.base_legs) {
    if (!(leg.shank.radius_m > 0.0)) continue;  // a test's
    for (const Capsule& limb : {leg.thigh, above_the_foot(leg.shank)}) {
      look(core_of(limb), truth.true_T_base, limb.radius_m);
    }
  }
}

std::string RouteReport::name_of(int step) const {
  if (step == kFloorStep) return "floor";
  if (step < 0) return "obstacle";
  const std::string& name = world_.steps[static_cast<std::size_t>(step)].name;
  return name.empty() ? "step " + std::to_string(step + 1) : name;
}

double RouteReport::distance_m(const WorldPlace& goal) const {
  const Vec2 middle_m = 0.5 * (last_.true_T_sole[0].p_m + last_.true_T_sole[1].p_m).head<2>();
  return (middle_m - Vec2(goal.x_m, goal.y_m)).norm();
}

bool RouteReport::is_at_goal(const WorldPlace& goal) const {
  if (distance_m(goal) > kGoalWithin_m || last_.fell) return false;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const bool rests = stands_since_ns_[foot] >= 0 && last_.stamp_ns - stands_since_ns_[foot] >= kRest_ns;
    if (!rests || !world_.are_one(last_.step_index[foot], goal.step)) return false;
  }
  const double yaw_rad = yaw_of(last_.true_T_base.R);
  return !goal.yaw_rad || std::abs(std::remainder(yaw_rad - *goal.yaw_rad, 2.0 * kPi)) <= kGoalWithin_rad;
}

void RouteReport::send_on(const WorldPlace& goal) {
  was_at_goal_ = was_at_goal_ && world_.goal && is_at_goal(*world_.goal);
  world_.goal = goal;
}

RouteFigures RouteReport::figures() const {
  RouteFigures figures;
  if (world_.goal) {
    figures.goal_reached = was_at_goal_ && is_at_goal(*world_.goal);
    figures.goal_distance_m = distance_m(*world_.goal);
  }
  for (const int step : stood_on_) {
    figures.surfaces_stood_on.push_back(name_of(step));
    const bool is_wrong = step >= 0 ? !world_.steps[static_cast<std::size_t>(step)].is_walkable : step != kFloorStep;
    if (is_wrong && figures.stood_on_wrongly.empty()) figures.stood_on_wrongly = name_of(step);
  }
  if (stood_on_.size() > 2) {
    figures.seconds_per_surface = seconds(last_came_ns_ - first_came_ns_) / static_cast<double>(stood_on_.size() - 2);
  }
  if (std::isfinite(body_clearance_m_)) figures.body_clearance_min_m = body_clearance_m_;
  return figures;
}

}  // namespace polygmap::sim
