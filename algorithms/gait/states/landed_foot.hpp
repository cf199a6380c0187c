// SPDX-License-Identifier: Apache-2.0
// The foot that landed last, held where it landed until it is pressed: it would go along with what the base is off its
// plan, 5 mm towards the next riser.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/gait/states/gait_params.hpp"

namespace polygmap {

class LandedFoot {
 public:
  // felt: its force told of the ground.
  void land(Foot foot, bool felt, std::int64_t now_ns, const Transform& odom_T_sole,
            const Transform& plan_T_sole) noexcept {
    *this = {};
    foot_ = foot;
    felt_ = felt;
    held_ = true;
    landed_ns_ = now_ns;
    odom_T_sole_ = odom_T_sole;
    plan_T_sole_ = plan_T_sole;
  }
  void release() noexcept { held_ = false; }
  // One tick.
  void update(const LandedFootParams& params, const JointFeedback& feedback, std::int64_t now_ns) noexcept {
    const std::int64_t most_ns = felt_ ? params.felt_hold_ns : params.hold_ns;
    held_ = feedback.foot_force_n[index_of(foot_)] < params.pressed_n && now_ns - landed_ns_ < most_ns;
  }
  // The plan goes on in another frame.
  void carry(const Transform& to_T_plan) noexcept { plan_T_sole_ = to_T_plan * plan_T_sole_; }

  [[nodiscard]] bool held() const noexcept { return held_; }
  [[nodiscard]] Foot foot() const noexcept { return foot_; }
  // As it was asked to be when it landed; in the plan frame it follows no correction.
  [[nodiscard]] const Transform& odom_T_sole() const noexcept { return odom_T_sole_; }
  [[nodiscard]] const Transform& plan_T_sole() const noexcept { return plan_T_sole_; }

 private:
  Foot foot_ = Foot::kLeft;
  bool felt_ = false;
  bool held_ = false;
  std::int64_t landed_ns_ = 0;
  Transform odom_T_sole_, plan_T_sole_;
};

}  // namespace polygmap
