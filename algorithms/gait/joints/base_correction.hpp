// SPDX-License-Identifier: Apache-2.0
// The base is where the estimator says, not where the plan wanted it: the difference between the two, with which the
// swing foot is steered and the plan is carried back to odometry at every touch-down. Low-passed, but not late: the
// difference of their speeds makes up for the low-pass.
#pragma once

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/time.hpp"

namespace polygmap {

class BaseCorrection {
 public:
  void reset() noexcept {
    offset_m_.setZero();
    rotation_rad_.setZero();
    known_ = false;  // the plan moves on as before, in another frame
  }
  // One tick. odom_v_base_mps, odom_w_base_radps: of the base as estimated. tau_s: of the low-pass.
  void update(const Transform& odom_T_base, const Vec3& odom_v_base_mps, const Vec3& odom_w_base_radps,
              const Transform& plan_T_base, double tau_s) noexcept {
    if (known_) {
      plan_v_mps_ = (plan_T_base.p_m - before_.p_m) / kTick_s;
      plan_w_radps_ = small_rotation(plan_T_base.R * before_.R.transpose()) / kTick_s;
    }
    before_ = plan_T_base;
    known_ = true;
    const double share = kTick_s / (kTick_s + tau_s);
    const Vec3 ahead_m = tau_s * (odom_v_base_mps - plan_v_mps_),
               ahead_rad = tau_s * (odom_w_base_radps - plan_w_radps_);
    const Vec3 rotation_rad = small_rotation(odom_T_base.R * plan_T_base.R.transpose());
    offset_m_ += share * (odom_T_base.p_m - plan_T_base.p_m + ahead_m - offset_m_);
    rotation_rad_ += share * (rotation_rad + ahead_rad - rotation_rad_);
  }
  // A tick without an estimate: the plan's way until the next one is not that of one tick.
  void missed() noexcept { known_ = false; }
  // Moves anything of the plan to odometry, given where the plan has the base: the difference is known at the base.
  [[nodiscard]] Transform odom_T_plan(const Transform& plan_T_base) const noexcept {
    const Mat3 R = rotation_zyx(rotation_rad_.z(), rotation_rad_.y(), rotation_rad_.x());
    return {R, plan_T_base.p_m + offset_m_ - R * plan_T_base.p_m};
  }

 private:
  static Vec3 small_rotation(const Mat3& R) noexcept {
    return {0.5 * (R(2, 1) - R(1, 2)), 0.5 * (R(0, 2) - R(2, 0)), 0.5 * (R(1, 0) - R(0, 1))};
  }

  Transform before_;  // of the plan
  Vec3 plan_v_mps_ = Vec3::Zero();
  Vec3 plan_w_radps_ = Vec3::Zero();
  bool known_ = false;
  Vec3 offset_m_ = Vec3::Zero();
  Vec3 rotation_rad_ = Vec3::Zero();  // small
};

}  // namespace polygmap
