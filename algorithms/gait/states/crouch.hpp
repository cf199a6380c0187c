// SPDX-License-Identifier: Apache-2.0
// On two feet a body off its plan needs longer legs than planned: the torso is lower by as much.
#pragma once

#include "algorithms/gait/states/state.hpp"

namespace polygmap {

class Crouch {
 public:
  // The torso is to be there when nothing is off: as low as the body is off now.
  void begin(const GaitInput& in, const GaitShared& gait, const TorsoPose& torso) noexcept {
    torso_ = torso;
    crouched_m_ = wanted_m(in, gait.params);
  }
  // One tick: lower, as soon as it is needed for longer than an estimate jumps. rest_ticks: of the torso's plan.
  void update(const GaitInput& in, GaitShared& gait, std::int32_t rest_ticks) noexcept {
    const CrouchParams& params = gait.params.crouch;
    const double wanted = wanted_m(in, gait.params);
    if (wanted < crouched_m_ + params.step_m) {
      off_ticks_ = 0;
      return;
    }
    if (++off_ticks_ < params.off_ticks) return;
    crouched_m_ = wanted;
    gait.plan.move_torso(torso(), std::max(rest_ticks, params.plan_ticks), params.plan_ticks);
  }
  void set_upright_height_m(double height_m) noexcept { torso_.position_m.z() = height_m; }

  [[nodiscard]] bool crouches() const noexcept { return crouched_m_ > 0.0; }
  [[nodiscard]] TorsoPose torso() const noexcept {
    TorsoPose torso = torso_;
    torso.position_m.z() -= crouched_m_;
    return torso;
  }
  [[nodiscard]] double upright_height_m() const noexcept { return torso_.position_m.z(); }

 private:
  [[nodiscard]] static double wanted_m(const GaitInput& in, const GaitParams& params) noexcept {
    const double off_m = in.odom_dcm_error_m.norm();
    const bool falls = off_m > params.swing.timing.falling_outward_m;
    return falls ? std::min(params.crouch.gain * off_m, params.crouch.max_m) : 0.0;
  }

  TorsoPose torso_;  // plan frame, where nothing is off
  double crouched_m_ = 0.0;
  std::int32_t off_ticks_ = 0;  // for which more was wanted
};

}  // namespace polygmap
