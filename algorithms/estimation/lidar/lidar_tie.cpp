// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/lidar_tie.hpp"

#include <utility>

#include "algorithms/core/time.hpp"
#include "algorithms/estimation/lidar/lio_fusion.hpp"

namespace polygmap {

bool LidarTie::try_correct(const Transform& odom_T_base, const Transform& lidar_T_base, std::int64_t stamp_ns,
                           double age_s, double position_sigma_m, double yaw_sigma_rad, ContactInEkf& filter,
                           Transform& moved) noexcept {
  const Transform then = filter_T_odom_ * odom_T_base;
  const LidarSigmas sigmas{position_sigma_m, yaw_sigma_rad, params_.tilt_sigma_rad};
  const double since_s = seconds(stamp_ns - std::exchange(stamp_ns_, stamp_ns));
  ContactInEkf::LidarRows rows;
  if (tied_) {
    filter.drift_lidar(math::square(params_.walk_mprs) * since_s, math::square(params_.walk_radprs) * since_s);
    rows = filter.lidar_rows(then, lidar_T_base, age_s, sigmas);
    const bool denied = rows.ratio > params_.most_ratio;
    denied_ = denied ? denied_ + 1 : 0;
    if (denied && denied_ < params_.most_denied) return false;
    tied_ = !denied;
  }
  if (!tied_) {
    filter.tie_lidar(then, tied_level(then, lidar_T_base), age_s, sigmas);
    denied_ = 0;
    tied_ = true;
    return false;
  }
  const Vec3 before_m = filter.odom_p_base_m();
  const double before_rad = yaw_of(filter.odom_R_base());
  filter.correct_by_lidar(then, rows, age_s, sigmas);
  moved.R = rotation_z(math::wrap_angle(yaw_of(filter.odom_R_base()) - before_rad));
  moved.p_m = filter.odom_p_base_m() - moved.R * before_m;
  filter_T_odom_ = moved * filter_T_odom_;
  return true;
}

}  // namespace polygmap
