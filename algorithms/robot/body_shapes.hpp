// SPDX-License-Identifier: Apache-2.0
// The parts of the robot that its own camera can see, as shapes that follow the joints: what the self-filter masks and
// what the simulated camera renders.
#pragma once

#include "algorithms/core/work.hpp"
#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

struct Capsule {
  Vec3 a_m = Vec3::Zero();
  Vec3 b_m = Vec3::Zero();
  double radius_m = 0.0;
};
struct OrientedBox {
  Transform centre;  // pose of the box's centre and axes
  Vec3 half_m = Vec3::Zero();
};
struct LegShapes {
  Capsule thigh;
  Capsule shank;
  OrientedBox foot;
};

// In the base frame.
[[nodiscard]] LegShapes base_leg_shapes(const RobotModel& robot, Foot leg, const LegVector& q_rad) noexcept;

// The foot's collision box for a sole pose, in the frame of that pose.
[[nodiscard]] OrientedBox collision_box(const SoleModel& model, const Transform& sole) noexcept;

// Signed distance of a point to a shape's surface, m; negative inside. Same frame for both.
[[nodiscard]] double signed_distance_m(const Capsule& capsule, const Vec3& point_m) noexcept;
[[nodiscard]] double signed_distance_m(const OrientedBox& box, const Vec3& point_m) noexcept;

// How far the body may be from where its joints say: a length, and a turn of the camera about itself.
struct BodyMargin {
  double fixed_m = 0.0;
  double turn_rad = 0.0;
  [[nodiscard]] double at(double distance_m) const noexcept { return fixed_m + turn_rad * distance_m; }
};

// Whether a leg, grown by a margin, is between the origin and a point. Shapes of radius or size 0 are absent.
[[nodiscard]] bool hides(const LegShapes& leg, double margin_m, const Vec3& point_m, WorkCount& work) noexcept;

}  // namespace polygmap
