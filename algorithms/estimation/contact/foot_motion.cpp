// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/foot_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace polygmap {

void FootMotion::reset(const Params& params) noexcept {
  *this = FootMotion{};
  params_ = params;
  usual_m2ps2_ = math::square(params.usual_mps);
}

void FootMotion::update(const std::array<Step, kFootCount>& steps, double dt_s) noexcept {
  // A base that is thought to turn otherwise than it does feigns a speed of the foot, and tells it by the sole's turn.
  std::array<Vec3, kFootCount> odom_v_mps, unturned_mps;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    Track& track = feet_[foot];
    const Step& step = steps[foot];
    track.walk_m2ps = 0.0;
    if (!step.rests) {
      track = {};
      continue;
    }
    const double share = dt_s / (std::min(params_.window_s, track.age_s) + dt_s);
    track.odom_v_mps += share * (step.odom_m / dt_s - track.odom_v_mps);
    track.odom_w_radps += share * (step.odom_rad / dt_s - track.odom_w_radps);
    track.age_s += dt_s;
    odom_v_mps[foot] = unturned_mps[foot] = track.odom_v_mps;
    if (step.sole_known) unturned_mps[foot] -= track.odom_w_radps.cross(step.odom_from_base_m);
    track.speed_mps = std::min(odom_v_mps[foot].norm(), unturned_mps[foot].norm());
  }
  if (steps[0].rests && steps[1].rests) {
    const double apart_mps =
        std::min((odom_v_mps[0] - odom_v_mps[1]).norm(), (unturned_mps[0] - unturned_mps[1]).norm());
    let_go(feet_[feet_[0].speed_mps > feet_[1].speed_mps ? 0 : 1], apart_mps, params_.slip_mps, dt_s);
    return;
  }
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (!steps[foot].rests) continue;
    const double slip_mps = std::max(params_.alone_slip_mps, params_.usual_times * math::sqrt(usual_m2ps2_));
    const double seen_m2ps2 = math::square(std::min(feet_[foot].speed_mps, params_.usual_share * slip_mps));
    usual_m2ps2_ += dt_s / (params_.usual_s + dt_s) * (seen_m2ps2 - usual_m2ps2_);
    let_go(feet_[foot], feet_[foot].speed_mps, slip_mps, dt_s);
  }
}

void FootMotion::let_go(Track& track, double speed_mps, double slip_mps, double dt_s) noexcept {
  if (!(speed_mps > slip_mps) || track.let_go_s > params_.most_s || 1.5 * dt_s > params_.window_s) return;
  track.let_go_s += dt_s;
  track.walk_m2ps = params_.gain * (math::square(speed_mps) - 0.5 * math::square(slip_mps)) * params_.window_s;
}

}  // namespace polygmap
