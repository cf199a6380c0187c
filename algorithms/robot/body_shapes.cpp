// SPDX-License-Identifier: Apache-2.0
#include "algorithms/robot/body_shapes.hpp"

#include <algorithm>

namespace polygmap {

OrientedBox collision_box(const SoleModel& model, const Transform& sole) noexcept {
  const SoleRectangle& r = model.collision;
  const double half_height_m = 0.5 * model.collision_height_m;
  const Transform sole_T_centre{Mat3::Identity(), Vec3{r.centre_x_m(), 0, half_height_m}};
  return {sole * sole_T_centre, Vec3{0.5 * r.length_m(), r.half_width_m, half_height_m}};
}

LegShapes base_leg_shapes(const RobotModel& robot, Foot leg, const LegVector& q_rad) noexcept {
  const LegPoints points = base_p_leg(robot.legs, leg, q_rad);
  return {{points.hip_pitch_m, points.knee_m, robot.radii.thigh_m},
          {points.knee_m, points.ankle_m, robot.radii.shank_m},
          collision_box(robot.sole, base_T_sole(robot.legs, leg, q_rad))};
}

double signed_distance_m(const Capsule& capsule, const Vec3& point_m) noexcept {
  const Vec3 axis = capsule.b_m - capsule.a_m;
  const double length2 = std::max(axis.squaredNorm(), 1e-12);
  const double along = math::clamp((point_m - capsule.a_m).dot(axis) / length2, 0.0, 1.0);
  return (point_m - capsule.a_m - along * axis).norm() - capsule.radius_m;
}

double signed_distance_m(const OrientedBox& box, const Vec3& point_m) noexcept {
  const Vec3 q = (box.centre.inverse() * point_m).cwiseAbs() - box.half_m;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

bool hides(const LegShapes& leg, double margin_m, const Vec3& point_m, WorkCount& work) noexcept {
  // Of the way along the ray: numbers of a search, which bound its time.
  constexpr int kMaxSteps = 64;
  constexpr double kStep_m = 0.02;
  const double range_m = point_m.norm();
  const Vec3 direction = point_m / std::max(range_m, 1e-6);
  double along_m = 0.0;
  work.add(60);
  for (int i = 0; i < kMaxSteps && along_m < range_m; ++i) {
    work.add(150);
    const Vec3 p = along_m * direction;
    double clear_m = range_m;
    for (const Capsule* capsule : {&leg.thigh, &leg.shank}) {
      if (capsule->radius_m > 0.0) clear_m = std::min(clear_m, signed_distance_m(*capsule, p));
    }
    if (leg.foot.half_m.minCoeff() > 0.0) clear_m = std::min(clear_m, signed_distance_m(leg.foot, p));
    if (clear_m < margin_m) return true;
    along_m += std::max(clear_m - margin_m, kStep_m);
  }
  return false;
}

}  // namespace polygmap
