// SPDX-License-Identifier: Apache-2.0
// Points in plan as seen from a pose.
#pragma once

#include "algorithms/core/math/transform.hpp"
#include "algorithms/geometry/line.hpp"

namespace polygmap {

// The horizontal frame of a pose: its heading x, left y. The paper turns into the full base frame; torso pitch would
// move a far point by pitch x drop, so only the heading counts here.
class PlanFrame {
 public:
  PlanFrame() noexcept = default;
  explicit PlanFrame(const Transform& odom_T_pose) noexcept
      : origin_m_(odom_T_pose.p_m.head<2>()), heading_(unit_at(yaw_of(odom_T_pose.R))) {}
  [[nodiscard]] Vec2 operator()(const Vec2& odom_p_m) const noexcept {
    const Vec2 d = odom_p_m - origin_m_;
    return {heading_.dot(d), cross(heading_, d)};
  }
  [[nodiscard]] const Vec2& origin_m() const noexcept { return origin_m_; }
  [[nodiscard]] const Vec2& heading() const noexcept { return heading_; }

 private:
  Vec2 origin_m_ = Vec2::Zero();
  Vec2 heading_ = Vec2::UnitX();
};

}  // namespace polygmap
