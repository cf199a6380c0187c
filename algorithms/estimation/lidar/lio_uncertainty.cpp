// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/lio_uncertainty.hpp"

#include <algorithm>

namespace polygmap {
namespace {

constexpr int kYaw = 3;

LioUncertainty::Quantities variances(double sigma_m, double sigma_rad) noexcept {
  const double m2 = math::square(sigma_m);
  return {m2, m2, m2, math::square(sigma_rad)};
}

}  // namespace

void LioUncertainty::reset(const Params& params) noexcept {
  *this = LioUncertainty{};
  params_ = params;
  start_variance_ = variances(params.initial_sigma_m, params.initial_sigma_rad);
}

void LioUncertainty::move(const Vec3& world_step_m) noexcept {
  const double drift_m = params_.drift_per_m * world_step_m.norm();
  const double yaw_sigma_rad = math::sqrt(offset_variance()[kYaw]);
  bent_m_ += yaw_sigma_rad * Vec3{-world_step_m.y(), world_step_m.x(), 0.0};
  lag_ += Quantities{drift_m, drift_m, drift_m, 0.0};
}

void LioUncertainty::blend(double gain, double lio_sigma_m, double lio_sigma_rad) noexcept {
  const double kept = 1.0 - gain;
  lag_ *= kept;
  bent_m_ *= kept;
  walk_variance_ *= math::square(kept);
  noise_variance_ = math::square(kept) * noise_variance_ + math::square(gain) * variances(lio_sigma_m, lio_sigma_rad);
  tie_share_ = 1.0 - kept * (1.0 - tie_share_);
}

void LioUncertainty::tie(const Vec3& world_p_base_m, double sigma_m, double sigma_rad,
                         const Quantities& known) noexcept {
  start_variance_ = known;
  lag_.setZero();
  bent_m_.setZero();
  walk_variance_.setZero();
  noise_variance_.setZero();
  tie_covariance_.setZero();
  tie_variance_ = variances(sigma_m, sigma_rad);
  tie_share_ = 0.0;
  tie_world_p_base_m_ = world_p_base_m;
}

// A Kalman gain: the innovation is the tie's error and LIO's noise less the odometry's error.
LioUncertainty::TieGains LioUncertainty::tie_gains(double lio_sigma_m, double lio_sigma_rad) const noexcept {
  const Quantities shared = tie_variance_ - tie_covariance_;
  const Quantities all = shared + offset_variance() - tie_covariance_ + variances(lio_sigma_m, lio_sigma_rad);
  return {std::clamp(shared.head<3>().sum() / all.head<3>().sum(), 0.0, 1.0),
          std::clamp(shared[kYaw] / all[kYaw], 0.0, 1.0)};
}

void LioUncertainty::average(const TieGains& gains, double lio_sigma_m, double lio_sigma_rad) noexcept {
  const Eigen::Array4d gain{gains.position, gains.position, gains.position, gains.rotation};
  const Eigen::Array4d kept = 1.0 - gain, odometry = offset_variance(), tie = tie_variance_, cross = tie_covariance_;
  const Eigen::Array4d noise = variances(lio_sigma_m, lio_sigma_rad);
  tie_variance_ = kept.square() * tie + gain.square() * (odometry + noise) + 2.0 * kept * gain * cross;
  tie_covariance_ = kept * cross + gain * odometry;
}

LioUncertainty::Quantities LioUncertainty::offset_variance() const noexcept {
  Quantities variance = lag_.cwiseAbs2() + walk_variance_ + noise_variance_;
  variance.head<3>() += bent_m_.cwiseAbs2();
  return variance;
}

Vec3 LioUncertainty::position_sigma_m(const Vec3& world_p_base_m) const noexcept {
  const Vec3 way2_m2 = (world_p_base_m - tie_world_p_base_m_).cwiseAbs2();
  const Vec3 turned_m2 = tie_variance_[kYaw] * (Vec3::Constant(way2_m2.sum()) - way2_m2);  // about any axis
  const Vec3 tie_m2 = math::square(tie_share_) * (tie_variance_.head<3>() + turned_m2) +
                      2.0 * tie_share_ * (1.0 - tie_share_) * tie_covariance_.head<3>();
  return ((start_variance_ + offset_variance()).head<3>() + tie_m2).cwiseSqrt();
}

double LioUncertainty::yaw_sigma_rad() const noexcept {
  const double tie_rad2 =
      math::square(tie_share_) * tie_variance_[kYaw] + 2.0 * tie_share_ * (1.0 - tie_share_) * tie_covariance_[kYaw];
  return math::sqrt(start_variance_[kYaw] + offset_variance()[kYaw] + tie_rad2);
}

}  // namespace polygmap
