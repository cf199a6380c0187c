// SPDX-License-Identifier: Apache-2.0
// Leg kinematics both ways, closed form.
#pragma once

#include "algorithms/robot/leg_frames.hpp"

namespace polygmap {

using LegJacobian = Eigen::Matrix<double, 6, static_cast<int>(kJointsPerLeg)>;

[[nodiscard]] LegVector leg_joints(const JointVector& q_rad, Foot leg) noexcept;

// base_T_sole of one leg for joint angles in rad: hip roll, hip yaw, hip pitch, knee, ankle pitch, ankle roll.
[[nodiscard]] Transform base_T_sole(const LegGeometry& geometry, Foot leg, const LegVector& q_rad) noexcept;

// Positions of the joints' centres in the base frame, for shapes and drawings.
struct LegPoints {
  Vec3 hip_pitch_m, knee_m, ankle_m;
};
[[nodiscard]] LegPoints base_p_leg(const LegGeometry& geometry, Foot leg, const LegVector& q_rad) noexcept;

// Rows 0-2: velocity of the sole frame's origin, rows 3-5: angular velocity, both in the base frame, per joint rate.
[[nodiscard]] LegJacobian leg_jacobian(const LegFrames& frames) noexcept;

struct LegSolution {
  LegVector q_rad = LegVector::Zero();
  bool reachable = false;  // false: the leg is too short or too folded; q is the nearest pose in that direction
};
// Joint angles that put the sole at base_T_sole, not clamped to the joints' ranges. Knee bent forward. Source: own
// derivation; the roll and yaw axes meet and the three pitch axes are parallel, so the ankle roll follows from the
// hip's place in the foot frame.
[[nodiscard]] LegSolution solve_leg(const LegGeometry& geometry, Foot leg, const Transform& base_T_sole) noexcept;

// Least margin of q to the joint limits of that leg, rad; negative outside.
[[nodiscard]] double limit_margin_rad(const DriveModel& drives, Foot leg, const LegVector& q_rad) noexcept;

}  // namespace polygmap
