// SPDX-License-Identifier: Apache-2.0
// Where a foot may go as seen from the robot, eqs (20), (22), (23), (27), (28).
#pragma once

#include <algorithm>
#include <limits>

#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

// Range filter, eq. (20).
[[nodiscard]] inline bool in_range(const Vec2& base_p_m, double g_range_m) noexcept {
  return std::abs(base_p_m.x()) <= g_range_m && std::abs(base_p_m.y()) <= g_range_m;
}

// Lowest of toe and heel, eq. (22), but of the foot that stays only: with the lower of both, the tread under the upper
// foot would be found again in split stance.
[[nodiscard]] inline double z_foot_m(const SoleModel& model, const Transform& world_T_sole) noexcept {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& contact : model.contacts_m()) lowest = std::min(lowest, (world_T_sole * contact).z());
  return lowest;
}

// Height limit, eq. (23).
[[nodiscard]] constexpr bool below_limit(double z_m, double z_foot_m, double g_z_m) noexcept {
  return z_m <= z_foot_m + g_z_m;
}

// Bearing of a point from the robot relative to its heading, eq. (27), in (-pi, pi]. As printed it is the bearing from
// the world's origin.
[[nodiscard]] inline double relative_bearing_rad(const Transform& world_T_base, const Vec2& world_p_m) noexcept {
  const Vec2 d = world_p_m - world_T_base.p_m.head<2>();
  return math::wrap_angle(math::atan2(d.y(), d.x()) - yaw_of(world_T_base.R));
}

// The layer that the stance foot stands on, eq. (28).
[[nodiscard]] constexpr bool in_sole_layer(double z_m, double z_foot_m, double delta_foot_m) noexcept {
  return z_foot_m - delta_foot_m <= z_m && z_m <= z_foot_m + delta_foot_m;
}

}  // namespace polygmap
