// SPDX-License-Identifier: Apache-2.0
// The base is where the estimator says, not where the plan wanted it: a low-passed difference between the two, with
// which the swing foot is steered and the plan is carried back to odometry at every touch-down.
#pragma once

#include "algorithms/core/transform.hpp"

namespace polygmap {

class BaseCorrection {
 public:
  void reset() noexcept {
    offset_m_.setZero();
    rotation_rad_.setZero();
  }
  // share: of the new difference per tick, 0..1.
  void update(const Transform& odom_T_base, const Transform& plan_T_base, double share) noexcept {
    const Mat3 R = odom_T_base.R * plan_T_base.R.transpose();
    const Vec3 rotation_rad{0.5 * (R(2, 1) - R(1, 2)), 0.5 * (R(0, 2) - R(2, 0)), 0.5 * (R(1, 0) - R(0, 1))};
    offset_m_ += share * (odom_T_base.p_m - plan_T_base.p_m - offset_m_);
    rotation_rad_ += share * (rotation_rad - rotation_rad_);
  }
  // Moves anything of the plan to odometry, given where the plan has the base: the difference is known at the base.
  [[nodiscard]] Transform odom_T_plan(const Transform& plan_T_base) const noexcept {
    const Mat3 R = rotation_zyx(rotation_rad_.z(), rotation_rad_.y(), rotation_rad_.x());
    return {R, plan_T_base.p_m + offset_m_ - R * plan_T_base.p_m};
  }

 private:
  Vec3 offset_m_ = Vec3::Zero();
  Vec3 rotation_rad_ = Vec3::Zero();  // small
};

}  // namespace polygmap
