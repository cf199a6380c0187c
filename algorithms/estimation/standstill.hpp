// SPDX-License-Identifier: Apache-2.0
// Gyro bias and the direction of gravity, averaged while the robot stands still at the start.
#pragma once

#include "algorithms/core/samples.hpp"

namespace polygmap {

class StandstillCalibration {
 public:
  struct Params {
    double duration_s = 1.0;
    double max_rate_radps = 0.05;       // bias and noise stay well below
    double max_accel_error_mps2 = 1.0;  // of the measured gravity
    double max_joint_move_rad = 0.01;
    double min_foot_force_n = 50.0;
  };
  void reset(const Params& params) noexcept;
  // True when the whole duration was still. Motion or a foot in the air starts over.
  [[nodiscard]] bool try_finish(const ImuSample& imu, const JointFeedback& joints) noexcept;

  [[nodiscard]] std::uint32_t restarts() const noexcept { return restarts_; }
  [[nodiscard]] std::int64_t start_ns() const noexcept { return start_ns_; }
  [[nodiscard]] bool collecting() const noexcept { return samples_ > 0; }
  [[nodiscard]] Vec3 gyro_bias_radps() const noexcept { return gyro_sum_ / samples_; }
  [[nodiscard]] double gravity_mps2() const noexcept { return (accel_sum_ / samples_).norm(); }
  [[nodiscard]] Mat3 odom_R_base() const noexcept;  // roll and pitch from gravity, yaw 0
  [[nodiscard]] JointVector q_rad() const noexcept { return q_sum_ / samples_; }

 private:
  Params params_;
  Vec3 gyro_sum_ = Vec3::Zero();
  Vec3 accel_sum_ = Vec3::Zero();
  JointVector q_sum_ = JointVector::Zero();
  JointVector first_q_rad_ = JointVector::Zero();
  double samples_ = 0.0;
  std::int64_t start_ns_ = 0;
  std::uint32_t restarts_ = 0;
};

}  // namespace polygmap
