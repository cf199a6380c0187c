// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/foot_motion.hpp"

#include <algorithm>

namespace polygmap {

void FootMotion::reset(const Params& params) noexcept {
  *this = FootMotion{};
  params_ = params;
  noise_m_.reset(params.noise);
}

void FootMotion::update(std::size_t foot, const Vec3& odom_step_m, double speed_sigma_mps, bool stands,
                        double dt_s) noexcept {
  Track& track = feet_[foot];
  // The change between two steps holds no speed, and no acceleration but the IMU's error: noise alone, six times over.
  constexpr double kRows = 6.0 * 3.0;
  if (track.has_step && stands) noise_m_.take((odom_step_m - track.last_step_m).squaredNorm() / kRows, dt_s);
  track.last_step_m = odom_step_m;
  track.has_step = true;

  const double position_sigma_m = noise_m_.sigma();
  const double window_s =
      math::clamp(position_sigma_m / params_.speed_sigma_mps, params_.min_window_s, params_.max_window_s);
  const double share = dt_s / (window_s + dt_s);
  track.odom_v_mps += share * (odom_step_m / dt_s - track.odom_v_mps);
  // Low-passed differences of white noise: sigma over the window.
  const double variance_m2ps2 = math::square(position_sigma_m / (window_s + dt_s)) + math::square(speed_sigma_mps) +
                                math::square(params_.rest_sigma_mps);
  const double beyond_m2ps2 = track.odom_v_mps.squaredNorm() - math::square(params_.rest_sigmas) * variance_m2ps2;
  track.walk_m2ps = params_.gain * std::max(beyond_m2ps2, 0.0) * window_s;
}

}  // namespace polygmap
