// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/standstill.hpp"

#include <algorithm>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {

void StandstillCalibration::reset(const Params& params) noexcept {
  *this = StandstillCalibration{};
  params_ = params;
}

void StandstillCalibration::begin(const ImuSample& imu, const JointFeedback& joints, const Legs& legs) noexcept {
  felt_rad_.setZero();
  felt_mps_.setZero();
  times_ = {};
  turn_ = velocity_ = {};
  time_s_ = 0.0;
  first_q_rad_ = joints.q_rad;
  first_mps2_ = imu.accel_mps2;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) first_base_R_sole_[foot] = legs[foot].base_T_sole.R;
  start_ns_ = imu.stamp_ns;
}

bool StandstillCalibration::try_finish(const ImuSample& imu, const JointFeedback& joints, const Legs& legs) noexcept {
  // What is not told, not a number, presses nothing.
  const auto loaded = [this](double force_n) { return force_n >= params_.min_foot_force_n; };
  const bool moves =
      imu.gyro_radps.cwiseAbs().maxCoeff() > params_.max_rate_radps ||
      std::abs(imu.accel_mps2.norm() - kGravity_mps2) > params_.max_accel_error_mps2 ||
      !std::ranges::all_of(joints.foot_force_n, loaded) ||
      (samples_ > 0.0 && (joints.q_rad - first_q_rad_).cwiseAbs().maxCoeff() > params_.max_joint_move_rad);
  if (moves) {
    if (samples_ > 0.0) ++restarts_;
    samples_ = 0.0;
    return false;
  }
  if (samples_ == 0.0) begin(imu, joints, legs);
  samples_ += 1.0;
  const double time_s = seconds(imu.stamp_ns - start_ns_), dt_s = time_s - time_s_;
  time_s_ = time_s;

  // The soles rest: the base turns against them, and moves.
  Vec3 turned_rad = Vec3::Zero();
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    turned_rad += so3_log(first_base_R_sole_[foot] * legs[foot].base_T_sole.R.transpose()) / kFootCount;
  }
  first_base_R_base_ = so3_exp(turned_rad);
  felt_rad_ += dt_s * imu.gyro_radps;
  felt_mps_ += dt_s * (first_base_R_base_ * imu.accel_mps2);
  times_.count += 1.0;
  times_.sum_s += time_s;
  times_.sum_s2 += math::square(time_s);
  turn_.add(time_s, felt_rad_ - turned_rad);
  velocity_.add(time_s, felt_mps_ - first_base_R_base_ * base_v_base_mps(legs));
  return time_s >= params_.duration_s && times_.spread() > 0.0;
}

Vec3 StandstillCalibration::first_base_g_mps2() const noexcept {
  if (time_s_ >= params_.min_line_s) return velocity_.slope(times_);
  return time_s_ > 0.0 ? Vec3(felt_mps_ / time_s_) : first_mps2_;
}

Mat3 StandstillCalibration::odom_R_base() const noexcept {
  return level_attitude(first_base_R_base_.transpose() * first_base_g_mps2());
}

Mat3 level_attitude(const Vec3& up) noexcept {
  const double roll_rad = math::atan2(up.y(), up.z());
  const double pitch_rad = math::atan2(-up.x(), math::sqrt(math::square(up.y()) + math::square(up.z())));
  return rotation_y(pitch_rad) * rotation_x(roll_rad);
}

Vec3 StandstillCalibration::odom_v_base_mps() const noexcept {
  return odom_R_base() * first_base_R_base_.transpose() * (felt_mps_ - velocity_.at(times_, time_s_));
}

}  // namespace polygmap
