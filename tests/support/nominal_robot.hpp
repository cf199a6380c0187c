// SPDX-License-Identifier: Apache-2.0
// The default-constructed robot under the short names that tests use.
#pragma once

#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

[[nodiscard]] inline const RobotModel& nominal_robot() noexcept {
  static const RobotModel robot;
  return robot;
}

inline constexpr SoleModel kSole{};
inline constexpr SoleRectangle kContactRectangle = kSole.contact;
inline constexpr SoleRectangle kCollisionRectangle = kSole.collision;
inline constexpr double kCollisionHeight_m = kSole.collision_height_m;
inline constexpr double kNominalBaseHeight_m = NominalStance{}.base_height_m;
inline constexpr double kStanceHalfWidth_m = NominalStance{}.half_width_m;
inline constexpr double kThighRadius_m = LegRadii{}.thigh_m;
inline constexpr double kCameraPitch_rad = 1.047;

[[nodiscard]] inline std::array<Vec3, kContactsPerFoot> sole_contacts_m() noexcept { return kSole.contacts_m(); }
[[nodiscard]] inline const Transform& base_T_camera() noexcept { return nominal_robot().mounts.base_T_camera; }
[[nodiscard]] inline const Transform& base_T_lidar() noexcept { return nominal_robot().mounts.base_T_lidar; }
[[nodiscard]] inline const JointLimits& joint_limits(Foot leg, std::size_t joint) noexcept {
  return nominal_robot().drives.limits_of(leg, joint);
}

}  // namespace polygmap
