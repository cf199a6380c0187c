// SPDX-License-Identifier: Apache-2.0
// Footsteps from torso poses (eqs 29-31), which foot swings (35-36) and where it goes on level floor (34).
// All poses in one frame with z up; the gait uses odom.
#pragma once

#include <array>

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/geometry/oriented_rectangle.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

// Eq. (29): the torso as the planner sees it, upright.
struct TorsoPose {
  Vec3 position_m = Vec3::Zero();
  double yaw_rad = 0.0;
  double lean_rad = 0.0;  // ahead
};

// A sole that lies on a surface. position: of the sole frame's origin.
struct SolePose {
  Vec3 position_m = Vec3::Zero();
  double yaw_rad = 0.0;
  Vec3 up = Vec3::UnitZ();  // the surface's normal
  [[nodiscard]] Transform transform() const noexcept { return {upright(up, yaw_rad), position_m}; }

 private:
  // Its z axis along up, its x axis above the heading.
  [[nodiscard]] static Mat3 upright(const Vec3& up, double yaw_rad) noexcept {
    const Vec3 left = up.cross(rotation_z(yaw_rad).col(0)).normalized();
    Mat3 R;
    R << left.cross(up), left, up;
    return R;
  }
};
using SolePair = std::array<SolePose, kFootCount>;

// Flattens a pose: where a sole stands is planned from, not how its ground slopes.
[[nodiscard]] inline SolePose sole_pose(const Transform& sole) noexcept { return {sole.p_m, yaw_of(sole.R)}; }

// In its own frame, a sole that was turned about its toe's edge until its heel has risen by that.
[[nodiscard]] inline Transform turned_about_toe(const SoleModel& sole, double heel_up_rad) noexcept {
  const Vec3 toe_m{sole.contact.toe_x_m, 0.0, 0.0};
  const Mat3 R = rotation_y(heel_up_rad);
  return {R, toe_m - R * toe_m};
}

// Eq. (31): the foot below a torso pose; half_width_m is the paper's y_b, z of the torso pose is height_m above it.
[[nodiscard]] SolePose foot_of_torso(const TorsoPose& torso, Foot foot, double half_width_m, double height_m) noexcept;
// Its inverse: the torso pose that the foot belongs to.
[[nodiscard]] TorsoPose torso_of_foot(const SolePose& sole, Foot foot, double half_width_m, double height_m) noexcept;
// The place of a foot beside a standing one: both belong to one torso pose.
[[nodiscard]] SolePose sole_beside(const SolePose& stance, Foot foot, double half_width_m) noexcept;
// The same on a tread: as far along it, and as straight, as the foot's foothold. A standing foot that slid and turned
// by 3 degrees has its side 11 mm over the edge.
[[nodiscard]] SolePose sole_beside_on_tread(const SolePose& stance, Foot foot, const SolePose& foothold,
                                            double half_width_m) noexcept;

// Between the feet, at their mean height and heading.
[[nodiscard]] TorsoPose middle_of(const SolePair& soles) noexcept;

struct TorsoDisplacement {
  Vec3 local_m = Vec3::Zero();
  double turn_rad = 0.0;
};
// Eq. (35), in the frame of the previous pose.
[[nodiscard]] TorsoDisplacement displacement(const TorsoPose& previous, const TorsoPose& next) noexcept;

struct SwingRule {
  double lateral_dead_band_m = 0.01;
  double turn_dead_band_rad = 0.035;

  static void visit(auto& p, auto& field) {
    field("lateral_dead_band_m", p.lateral_dead_band_m, 0.0, 0.5,
          "Eq. 36 decides on a step that goes farther to the side.");
    field("turn_dead_band_rad", p.turn_dead_band_rad, 0.0, 1.5, "Eq. 36 decides on a step that turns farther.");
  }
};
// Eq. (36). The printed rule always answers "right" for straight motion and swings the same foot twice in a turn: here
// it decides only where the displacement is beyond a dead band, otherwise the gait state does (by_gait_state).
[[nodiscard]] Foot swing_foot(const TorsoDisplacement& step, Foot by_gait_state, const SwingRule& rule) noexcept;

// Eq. (34): the ground a foot occupies, with a margin around the collision rectangle.
[[nodiscard]] OrientedRectangle foot_rectangle(const SoleRectangle& collision, const SolePose& sole,
                                               double margin_m) noexcept;

struct FloorStepLimits {
  double forward_m = 0.2;
  double backward_m = 0.1;
  double lateral_m = 0.05;
  double turn_rad = 0.14;
  double overlap_margin_m = 0.01;
  double outwards_m = 0.01;

  static void visit(auto& p, auto& field) {
    field("forward_m", p.forward_m, 0.01, 0.5,
          "A step on the floor goes no farther ahead of the place beside the stance foot.");
    field("backward_m", p.backward_m, 0.01, 0.5, "A step on the floor goes no farther back.");
    field("lateral_m", p.lateral_m, 0.005, 0.2,
          "A step on the floor goes no farther out: there the ankle roll of the leg left behind reaches its limit, "
          "0.262 rad.");
    field("turn_rad", p.turn_rad, 0.01, 0.8, "A step on the floor turns no more.");
    field("overlap_margin_m", p.overlap_margin_m, 0.0, 0.1, "Room around each foot.");
    field("outwards_m", p.outwards_m, 0.001, 0.05,
          "A foot that would land on the other one goes farther out by this until it does not.");
  }
};
[[nodiscard]] constexpr FloorStepLimits shortened(FloorStepLimits limits, double share) noexcept {
  limits.forward_m *= share;
  limits.backward_m *= share;
  limits.lateral_m *= share;
  limits.turn_rad *= share;
  return limits;
}
// The next step of `swing` on level floor towards the goal torso pose: the torso's displacement from the pose that the
// stance foot belongs to is limited (35), the foot follows from it (31) and moves outwards until the feet are apart
// (34).
[[nodiscard]] SolePose floor_step(const SoleRectangle& collision, const SolePose& stance, Foot swing,
                                  const TorsoPose& goal, double half_width_m, const FloorStepLimits& limits) noexcept;

}  // namespace polygmap
