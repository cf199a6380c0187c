// SPDX-License-Identifier: Apache-2.0
// Where a foot may go as seen from the robot, eqs (20), (22), (23), (27), (28).
#pragma once

#include <algorithm>

#include "algorithms/geometry/line.hpp"
#include "algorithms/robot/model.hpp"

namespace polygmap {

// The horizontal frame of a pose: its heading x, left y. The paper turns into the full base frame; torso pitch would
// move a far point by pitch x drop, so only the heading counts here.
class PlanFrame {
 public:
  PlanFrame() noexcept = default;
  explicit PlanFrame(const Transform& world_T_pose) noexcept
      : origin_m_(world_T_pose.p_m.head<2>()), heading_(unit_at(yaw_of(world_T_pose.R))) {}
  [[nodiscard]] Vec2 operator()(const Vec2& world_p_m) const noexcept {
    const Vec2 d = world_p_m - origin_m_;
    return {heading_.dot(d), cross(heading_, d)};
  }
  [[nodiscard]] const Vec2& origin_m() const noexcept { return origin_m_; }
  [[nodiscard]] const Vec2& heading() const noexcept { return heading_; }

 private:
  Vec2 origin_m_ = Vec2::Zero();
  Vec2 heading_ = Vec2::UnitX();
};

// Range filter, eq. (20).
[[nodiscard]] inline bool in_range(const Vec2& base_p_m, double g_range_m) noexcept {
  return std::abs(base_p_m.x()) <= g_range_m && std::abs(base_p_m.y()) <= g_range_m;
}

// Lowest of toe and heel, eq. (22), but of the foot that stays only: with the lower of both, the tread under the upper
// foot would be found again in split stance.
[[nodiscard]] inline double z_foot_m(const Transform& world_T_sole) noexcept {
  double lowest = (world_T_sole * sole_contacts_m()[0]).z();
  for (const Vec3& contact : sole_contacts_m()) lowest = std::min(lowest, (world_T_sole * contact).z());
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
