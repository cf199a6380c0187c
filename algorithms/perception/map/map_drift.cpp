// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/map_drift.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

void MapDrift::begin_frame(std::int64_t stamp_ns, double position_sigma_m) noexcept {
  if (stamp_ns_ < 0) {
    first_ns_ = stamp_ns;
  } else {
    // The pose has become less certain by what it may have drifted meanwhile.
    const double grown_m2 = std::max(0.0, math::square(position_sigma_m) - math::square(sigma_m_));
    const double walked_m2 = math::square(params_.walk_m_per_sqrt_s) * seconds(stamp_ns - stamp_ns_);
    covariance_m2_ += (grown_m2 + walked_m2) * Mat3::Identity();
  }
  stamp_ns_ = stamp_ns;
  sigma_m_ = position_sigma_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double variance_m2 = covariance_m2_(axis, axis);
    if (variance_m2 <= math::square(sigma_m_)) continue;
    const double shrink = sigma_m_ / math::sqrt(variance_m2);
    covariance_m2_.row(axis) *= shrink;
    covariance_m2_.col(axis) *= shrink;
  }
  information_.setZero();
  gradient_.setZero();
  const double bound_m = params_.bound_sigmas * sigma_m_;
  for (double& d : drift_m_) d = math::clamp(d, -bound_m, bound_m);
  frame_offset_m_ = drift_m_;
}

void MapDrift::add(const Vec3& direction, double innovation_m, double variance_m2) noexcept {
  const double expected_m2 = variance_m2 + math::square(sigma_m_) + direction.dot(covariance_m2_ * direction);
  const double most_m = params_.outlier_sigmas * math::sqrt(expected_m2);
  const double weight = std::min(1.0, most_m / std::max(std::abs(innovation_m), 1e-9)) / variance_m2;
  information_ += weight * direction * direction.transpose();
  gradient_ += weight * innovation_m * direction;
}

void MapDrift::end_frame() noexcept {
  const Mat3 I = Mat3::Identity();
  const double bound_m = params_.bound_sigmas * sigma_m_;
  // The frame's pose is off by the drift and by its own jitter, for which its sigma is the bound, too.
  const Mat3 frame_m2 = covariance_m2_ + math::square(sigma_m_) * I;
  frame_offset_m_ = drift_m_ + frame_m2 * ((I + information_ * frame_m2).inverse() * gradient_);
  // About the drift the frame says less, by what is its own.
  const Mat3 share = (I + math::square(params_.frame_sigma_m) * information_).inverse();
  const Mat3 gain = covariance_m2_ * (I + share * information_ * covariance_m2_).inverse();
  drift_m_ += gain * (share * gradient_);
  covariance_m2_ = 0.5 * (gain + gain.transpose());
  for (double& d : drift_m_) d = math::clamp(d, -bound_m, bound_m);
  if (seconds(stamp_ns_ - first_ns_) < params_.settle_s) frame_offset_m_ = drift_m_;
  for (double& c : frame_offset_m_) c = math::clamp(c, -bound_m, bound_m);
}

}  // namespace polygmap
