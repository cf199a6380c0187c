// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/foot_motion.hpp"

#include <algorithm>

namespace polygmap {

void FootMotion::reset(const Params& params) noexcept {
  *this = FootMotion{};
  params_ = params;
  position_sigma_m_ = params.first_position_sigma_m;
}

void FootMotion::update(std::size_t foot, const Vec3& odom_step_m, double speed_sigma_mps, double dt_s) noexcept {
  Track& track = feet_[foot];
  if (track.has_step) measure_noise(odom_step_m - track.last_step_m, dt_s);
  track.last_step_m = odom_step_m;
  track.has_step = true;

  const double window_s =
      math::clamp(position_sigma_m_ / params_.speed_sigma_mps, params_.min_window_s, params_.max_window_s);
  const double share = dt_s / (window_s + dt_s);
  track.odom_v_mps += share * (odom_step_m / dt_s - track.odom_v_mps);
  // Low-passed differences of white noise: sigma over the window.
  const double variance_m2ps2 = math::square(position_sigma_m_ / (window_s + dt_s)) + math::square(speed_sigma_mps) +
                                math::square(params_.rest_sigma_mps);
  const double beyond_m2ps2 = track.odom_v_mps.squaredNorm() - math::square(params_.rest_sigmas) * variance_m2ps2;
  track.walk_m2ps = params_.gain * std::max(beyond_m2ps2, 0.0) * window_s;
}

// The change between two steps holds no speed, and no acceleration but the IMU's error: noise alone, six times over.
// A step that is far out (a touch-down) counts as little more than usual.
void FootMotion::measure_noise(const Vec3& change_m, double dt_s) noexcept {
  noise_time_s_ = std::min(noise_time_s_ + dt_s, params_.noise_memory_s);
  constexpr double kRows = 6.0 * 3.0;
  const double usual_m2 = math::square(position_sigma_m_);
  const double seen_m2 = std::min(change_m.squaredNorm() / kRows, 4.0 * usual_m2);
  const double sigma_m = math::sqrt(usual_m2 + dt_s / noise_time_s_ * (seen_m2 - usual_m2));
  position_sigma_m_ = math::clamp(sigma_m, params_.min_position_sigma_m, params_.max_position_sigma_m);
}

}  // namespace polygmap
