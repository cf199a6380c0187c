// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/attitude_filter.hpp"

#include <algorithm>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {

void AttitudeFilter::reset(const Params& params) noexcept {
  *this = AttitudeFilter{};
  params_ = params;
}

void AttitudeFilter::initialise(const Mat3& odom_R_base, const Vec3& gyro_bias_radps, double gravity_mps2,
                                const std::array<Mat3, kFootCount>& base_R_sole) noexcept {
  odom_R_base_ = odom_R_base;
  bias_radps_ = gyro_bias_radps;
  gravity_mps2_ = gravity_mps2;
  for (AxisCovariance& P : P_) {
    P.setZero();
    P(kBias, kBias) = math::square(params_.initial_bias_sigma_radps);
  }
  for (std::size_t foot = 0; foot < kFootCount; ++foot) anchor(foot, base_R_sole[foot]);
  window_start_ns_ = -1;
}

void AttitudeFilter::anchor(std::size_t foot, const Mat3& base_R_sole) noexcept {
  odom_R_foot_[foot] = odom_R_base_ * base_R_sole;
  const int state = kFirstFoot + static_cast<int>(foot);
  for (AxisCovariance& P : P_) {
    P.row(state) = P.row(kAttitude);
    P.col(state) = P.col(kAttitude);
    P(state, state) = P(kAttitude, kAttitude) + math::square(params_.foot_sigma_rad);
  }
}

void AttitudeFilter::predict(const Vec3& gyro_radps, double dt_s) noexcept {
  odom_R_base_ = so3_renormalised(odom_R_base_ * so3_exp((gyro_radps - bias_radps_) * dt_s));
  for (AxisCovariance& P : P_) {  // attitude error grows by minus the bias error
    P.row(kAttitude) -= dt_s * P.row(kBias);
    P.col(kAttitude) -= dt_s * P.col(kBias);
    P(kAttitude, kAttitude) += math::square(params_.gyro_noise_radprs) * dt_s;
    P(kBias, kBias) += math::square(params_.bias_walk_radpsrs) * dt_s;
  }
}

void AttitudeFilter::correct_by_feet(const std::array<Mat3, kFootCount>& base_R_sole,
                                     const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept {
  const double variance = math::square(params_.foot_sigma_rad);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const int state = kFirstFoot + static_cast<int>(foot);
    if (!contacts[foot].stands || contacts[foot].landed) {
      anchor(foot, base_R_sole[foot]);
      continue;
    }
    const double walk = math::square(params_.foot_walk_radprs) * dt_s / std::max(contacts[foot].load_share, 0.05);
    // log(R^T R_foot M^T) = attitude error - foot error, in base axes.
    const Vec3 innovation_rad = so3_log(odom_R_base_.transpose() * odom_R_foot_[foot] * base_R_sole[foot].transpose());
    AxisGain row = AxisGain::Zero();
    row[kAttitude] = 1.0;
    row[state] = -1.0;
    std::array<AxisGain, 3> corrections;
    for (int axis = 0; axis < 3; ++axis) {
      P_[static_cast<std::size_t>(axis)](state, state) += walk;
      corrections[static_cast<std::size_t>(axis)] = correct_axis(axis, row, innovation_rad[axis], variance);
    }
    apply(corrections);
  }
}

void AttitudeFilter::correct_by_gravity(const Vec3& accel_mps2, const Vec3& odom_v_mps, double dt_s,
                                        std::int64_t stamp_ns) noexcept {
  window_force_mps_ += odom_R_base_ * accel_mps2 * dt_s;
  const double window_s = seconds(stamp_ns - window_start_ns_);
  if (window_start_ns_ >= 0 && window_s < params_.gravity_window_s) return;
  const bool first = window_start_ns_ < 0;
  const Vec3 up_mps2 = (window_force_mps_ - (odom_v_mps - window_start_v_mps_)) / window_s;
  window_force_mps_.setZero();
  window_start_v_mps_ = odom_v_mps;
  window_start_ns_ = stamp_ns;
  if (first) return;
  if (!((up_mps2 - Vec3{0, 0, gravity_mps2_}).norm() < params_.max_gravity_error_mps2)) {
    ++gravity_rejected_;
    return;
  }
  // Measured up against odom's z, as a small turn in base axes; about the vertical it says nothing.
  const Vec3 innovation_rad = odom_R_base_.transpose() * (up_mps2.normalized().cross(Vec3::UnitZ()));
  AxisGain row = AxisGain::Zero();
  row[kAttitude] = 1.0;
  const double variance = math::square(params_.gravity_sigma_rad);
  apply({correct_axis(0, row, innovation_rad.x(), variance), correct_axis(1, row, innovation_rad.y(), variance),
         AxisGain::Zero()});
}

AttitudeFilter::AxisGain AttitudeFilter::correct_axis(int axis, const AxisGain& row, double innovation_rad,
                                                      double variance) noexcept {
  AxisCovariance& P = P_[static_cast<std::size_t>(axis)];
  const AxisGain PHt = P * row;
  const double s = row.dot(PHt) + variance;
  for (int i = 0; i < kStates; ++i) {  // symmetric by construction
    for (int j = i; j < kStates; ++j) P(i, j) = P(j, i) = P(i, j) - PHt[i] * PHt[j] / s;
  }
  return PHt * (innovation_rad / s);
}

void AttitudeFilter::apply(const std::array<AxisGain, 3>& corrections) noexcept {
  const auto part = [&](int state) {
    return Vec3{corrections[0][state], corrections[1][state], corrections[2][state]};
  };
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const Vec3 turn_rad = odom_R_base_ * part(kFirstFoot + static_cast<int>(foot));
    odom_R_foot_[foot] = so3_renormalised(so3_exp(turn_rad) * odom_R_foot_[foot]);
  }
  odom_R_base_ = so3_renormalised(odom_R_base_ * so3_exp(part(kAttitude)));
  bias_radps_ += part(kBias);
}

}  // namespace polygmap
