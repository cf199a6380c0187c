// SPDX-License-Identifier: Apache-2.0
// The foot that landed last, held where it landed until it is pressed: it would go along with what the base is off its
// plan, 5 mm towards the next riser. One that landed early and then feels nothing hung on an edge, and is lowered to
// its target.
#pragma once

#include <algorithm>
#include <utility>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/gait/states/gait_params.hpp"

namespace polygmap {

class LandedFoot {
 public:
  // felt: its force told of the ground. early_m: so far above its target, 0 where it came in time.
  void land(Foot foot, bool felt, double early_m, std::int64_t now_ns, const Transform& odom_T_sole,
            const Transform& plan_T_sole) noexcept {
    *this = {};
    foot_ = foot;
    felt_ = felt;
    held_ = true;
    to_lower_m_ = early_m;
    landed_ns_ = now_ns;
    odom_T_sole_ = odom_T_sole;
    plan_T_sole_ = plan_T_sole;
  }
  void release() noexcept { held_ = false; }
  // One tick.
  void update(const LandedFootParams& params, const JointFeedback& feedback, std::int64_t now_ns) noexcept {
    const std::int64_t most_ns = felt_ ? params.felt_hold_ns : params.hold_ns;
    const double force_n = feedback.foot_force_n[index_of(foot_)];
    // Of a bus that falls silent the last sample is read on and on.
    const bool sampled = std::exchange(felt_stamp_ns_, feedback.stamp_ns) != feedback.stamp_ns;
    if (sampled) {
      unloaded_samples_ = force_n < params.unloaded_n ? unloaded_samples_ + 1 : 0;
      pressed_samples_ = force_n < params.pressed_n ? 0 : pressed_samples_ + 1;
    }
    // What landed early may have knocked against a riser, for a moment.
    const std::int32_t enough_samples = to_lower_m_ > 0.0 ? params.unloaded_samples : 0;
    held_ = pressed_samples_ <= enough_samples && now_ns - landed_ns_ < most_ns;
    silent_ticks_ = sampled ? 0 : silent_ticks_ + 1;
    lower(params, unloaded_samples_ > params.unloaded_samples && silent_ticks_ < kSilent_ticks);
  }
  // The plan goes on in another frame.
  void carry(const Transform& to_T_plan) noexcept { plan_T_sole_ = to_T_plan * plan_T_sole_; }

  [[nodiscard]] bool held() const noexcept { return held_; }
  [[nodiscard]] Foot foot() const noexcept { return foot_; }
  // As it was asked to be when it landed; in the plan frame it follows no correction.
  [[nodiscard]] const Transform& odom_T_sole() const noexcept { return odom_T_sole_; }
  [[nodiscard]] const Transform& plan_T_sole() const noexcept { return plan_T_sole_; }

 private:
  void lower(const LandedFootParams& params, bool hangs) noexcept {
    const double may_stop_mps = math::sqrt(params.lower_mps2 * to_lower_m_);  // with half of it: in whole ticks
    const double wanted_mps = hangs ? std::min(params.lower_mps, may_stop_mps) : 0.0;
    const double change_mps = params.lower_mps2 * kTick_s;
    speed_mps_ = math::clamp(wanted_mps, std::max(speed_mps_ - change_mps, 0.0), speed_mps_ + change_mps);
    const double by_m = std::min(to_lower_m_, speed_mps_ * kTick_s);
    to_lower_m_ -= by_m;
    odom_T_sole_.p_m.z() -= by_m;
    plan_T_sole_.p_m.z() -= by_m;
  }

  static constexpr std::int32_t kSilent_ticks = 3;  // a bus that misses one sample or two is not silent

  Foot foot_ = Foot::kLeft;
  bool felt_ = false;
  bool held_ = false;
  std::int64_t landed_ns_ = 0;
  std::int64_t felt_stamp_ns_ = 0;
  std::int32_t unloaded_samples_ = 0;
  std::int32_t pressed_samples_ = 0;
  std::int32_t silent_ticks_ = 0;
  double to_lower_m_ = 0.0;
  double speed_mps_ = 0.0;  // downwards
  Transform odom_T_sole_, plan_T_sole_;
};

}  // namespace polygmap
