// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/sensors/sensor_models.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

// The sample of so long ago, in whole ticks; the oldest where there is none so old.
template <class T, std::size_t N>
const T& late(const RingBuffer<T, N>& history, double delay_s, double tick_s) {
  const auto ticks = static_cast<std::size_t>(std::lround(delay_s / tick_s));
  return history[history.size() - 1 - std::min(ticks, history.size() - 1)];
}

}  // namespace

ImuModel::ImuModel(const ErrorParams& params, const RobotErrors& errors, std::uint64_t seed,
                   const Transform& true_T_base)
    : params_(params),
      errors_(errors),
      gyro_noise_(seed, Stream::kGyro),
      accel_noise_(seed, Stream::kAccel),
      previous_(true_T_base) {}

ImuSample ImuModel::sample(const Transform& true_T_base, std::int64_t stamp_ns, double tick_s) {
  const Eigen::AngleAxisd turn(Mat3(previous_.R.transpose() * true_T_base.R));
  const Vec3 base_w = turn.angle() * turn.axis() / tick_s;
  const Vec3 velocity_mps = (true_T_base.p_m - previous_.p_m) / tick_s;
  const Vec3 acceleration = (velocity_mps - previous_velocity_mps_) / tick_s;  // centred on the previous tick
  const Vec3 base_f = previous_.R.transpose() * (acceleration + Vec3{0, 0, kGravity_mps2});
  previous_ = true_T_base;
  previous_velocity_mps_ = velocity_mps;

  const Mat3 imu_R_base = errors_.base_R_imu.transpose();
  ImuSample sample;
  sample.gyro_radps = params_.gyro_scale * (imu_R_base * base_w) + errors_.gyro_bias_radps +
                      params_.gyro_noise_radps * gyro_noise_.normal3(index_);
  sample.accel_mps2 = params_.accel_scale * (imu_R_base * base_f) + errors_.accel_bias_mps2 +
                      params_.accel_noise_mps2 * accel_noise_.normal3(index_);
  ++index_;
  history_.push_overwrite(sample);
  sample = late(history_, params_.imu_delay_s, tick_s);
  sample.stamp_ns = stamp_ns;
  return sample;
}

JointFeedback JointModel::sample(const JointVector& drive_q_rad, const JointVector& drive_dq_radps,
                                 std::int64_t stamp_ns, double tick_s) {
  JointFeedback feedback;
  feedback.stamp_ns = stamp_ns;
  for (std::size_t j = 0; j < kJointCount; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    const std::uint64_t n = index_ * kJointCount + j;
    feedback.q_rad[i] = drive_q_rad[i] + params_.encoder_noise_rad * angle_noise_.normal(n);
    if (const double step_rad = params_.encoder_step_rad; step_rad > 0.0) {
      feedback.q_rad[i] = step_rad * std::round(feedback.q_rad[i] / step_rad);
    }
    feedback.dq_radps[i] = drive_dq_radps[i] + params_.joint_rate_noise_radps * rate_noise_.normal(n);
  }
  if (params_.rates_by_difference) {
    feedback.dq_radps = index_ > 0 ? JointVector((feedback.q_rad - last_q_rad_) / tick_s) : JointVector::Zero();
  }
  last_q_rad_ = feedback.q_rad;
  ++index_;
  return feedback;
}

std::array<double, kFootCount> FootForceModel::sample(const std::array<double, kFootCount>& contact_n,
                                                      const std::array<double, kFootCount>& true_sole_z_m,
                                                      double tick_s) {
  true_sole_z_m_.push_overwrite(true_sole_z_m);
  std::array<double, kFootCount> felt_n = contact_n;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    if (true_sole_z_m_.size() == 3) {
      const double up_mps2 =
          (true_sole_z_m_[2][f] - 2.0 * true_sole_z_m_[1][f] + true_sole_z_m_[0][f]) / (tick_s * tick_s);
      felt_n[f] -= params_.foot_force_mass_kg * up_mps2;
    }
    felt_n[f] *= params_.foot_force_scale;
    felt_n[f] += params_.foot_force_offset_n[f] + params_.foot_force_noise_n * noise_.normal(index_ * kFootCount + f);
  }
  ++index_;
  history_.push_overwrite(felt_n);
  return late(history_, params_.foot_force_delay_s, tick_s);
}

JointVector TorqueModel::sample(const JointVector& drive_tau_nm, const JointVector& dq_radps) {
  JointVector tau_nm = drive_tau_nm;
  constexpr double kCreep_radps = 0.02;  // friction turns round smoothly about here
  for (Eigen::Index j = 0; j < tau_nm.size(); ++j) {
    tau_nm[j] += params_.friction_nm * std::tanh(dq_radps[j] / kCreep_radps) +
                 params_.torque_noise_nm * noise_.normal(index_ * kJointCount + static_cast<std::uint64_t>(j));
  }
  ++index_;
  return tau_nm;
}

Transform LioModel::drifted(const Transform& true_T_base, std::int64_t stamp_ns) {
  if (last_ns_ < 0) start_m_ = true_T_base.p_m;
  const double since_s = last_ns_ < 0 ? 0.0 : seconds(stamp_ns - last_ns_);
  last_ns_ = stamp_ns;
  run_s_ += since_s;
  if (params_.lio_walk_mprs > 0.0) walk_m_ += params_.lio_walk_mprs * std::sqrt(since_s) * walk_noise_.normal3(index_);
  Transform pose = true_T_base;
  if (params_.lio_drift_radps != 0.0) {
    const Mat3 turn = rotation_z(params_.lio_drift_radps * run_s_);
    pose = {turn * pose.R, start_m_ + turn * (pose.p_m - start_m_)};
  }
  pose.p_m += walk_m_ + run_s_ * params_.lio_drift_mps;
  if (seconds(stamp_ns) >= params_.lio_jump_s) pose.p_m += params_.lio_jump_m;
  return pose;
}

LioSample LioModel::sample(const Transform& true_T_base, std::int64_t stamp_ns) {
  const double scale = params_.lio_sigma_scale;
  const Vec3 turn_rad = scale * params_.lio_rotation_rad * rotation_noise_.normal3(index_);
  const Transform noise{rotation_z(turn_rad.z()) * rotation_y(turn_rad.y()) * rotation_x(turn_rad.x()), Vec3::Zero()};
  LioSample sample;
  sample.stamp_ns = stamp_ns + std::llround(params_.lio_stamp_s * kNsPerS);
  sample.lio_T_lidar = errors_.lio_T_true * drifted(true_T_base, stamp_ns) * errors_.base_T_lidar * noise;
  sample.lio_T_lidar.p_m += scale * params_.lio_position_m * position_noise_.normal3(index_);
  constexpr double kLeastSigma = 1e-3;  // no odometry claims to be perfect
  sample.position_sigma_m.setConstant(std::max(params_.lio_position_m, kLeastSigma));
  sample.rotation_sigma_rad.setConstant(std::max(params_.lio_rotation_rad, kLeastSigma));
  ++index_;
  return sample;
}

}  // namespace polygmap::sim
