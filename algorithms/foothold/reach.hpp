// SPDX-License-Identifier: Apache-2.0
// Where a foot may go as seen from the robot, eqs (20), (22), (23), (28). The bearing of eq. (27)
// turns the published robot towards the stairs; here a foot's yaw is that of the nosing, which the map knows better
// than a bearing does, so nothing reads a bearing.
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
[[nodiscard]] inline double z_foot_m(const SoleModel& model, const Transform& odom_T_sole) noexcept {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& contact : model.contacts_m()) lowest = std::min(lowest, (odom_T_sole * contact).z());
  return lowest;
}

// Height limit, eq. (23).
[[nodiscard]] constexpr bool below_limit(double z_m, double z_foot_m, double g_z_m) noexcept {
  return z_m <= z_foot_m + g_z_m;
}

// The layer that the stance foot stands on, eq. (28). The published search erodes this layer apart from the others;
// here every mapped surface is a layer of its own, and the one underfoot is only asked how much of the floor was seen.
[[nodiscard]] constexpr bool in_sole_layer(double z_m, double z_foot_m, double delta_foot_m) noexcept {
  return z_foot_m - delta_foot_m <= z_m && z_m <= z_foot_m + delta_foot_m;
}

}  // namespace polygmap
