// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/standstill.hpp"

#include <algorithm>

namespace polygmap {

void StandstillCalibration::reset(const Params& params) noexcept {
  *this = StandstillCalibration{};
  params_ = params;
}

bool StandstillCalibration::try_finish(const ImuSample& imu, const JointFeedback& joints) noexcept {
  const bool moves =
      imu.gyro_radps.cwiseAbs().maxCoeff() > params_.max_rate_radps ||
      std::abs(imu.accel_mps2.norm() - kGravity_mps2) > params_.max_accel_error_mps2 ||
      std::min(joints.foot_force_n[0], joints.foot_force_n[1]) < params_.min_foot_force_n ||
      (samples_ > 0.0 && (joints.q_rad - first_q_rad_).cwiseAbs().maxCoeff() > params_.max_joint_move_rad);
  if (moves) {
    if (samples_ > 0.0) ++restarts_;
    samples_ = 0.0;
    return false;
  }
  if (samples_ == 0.0) {
    gyro_sum_.setZero();
    accel_sum_.setZero();
    q_sum_.setZero();
    first_q_rad_ = joints.q_rad;
    start_ns_ = imu.stamp_ns;
  }
  gyro_sum_ += imu.gyro_radps;
  accel_sum_ += imu.accel_mps2;
  q_sum_ += joints.q_rad;
  samples_ += 1.0;
  return seconds(imu.stamp_ns - start_ns_) >= params_.duration_s;
}

Mat3 StandstillCalibration::odom_R_base() const noexcept {
  const Vec3 up = accel_sum_;
  const double roll_rad = math::atan2(up.y(), up.z());
  const double pitch_rad = math::atan2(-up.x(), math::sqrt(math::square(up.y()) + math::square(up.z())));
  return rotation_y(pitch_rad) * rotation_x(roll_rad);
}

}  // namespace polygmap
