// SPDX-License-Identifier: Apache-2.0
// Gyro bias and the direction of gravity while the robot stands at the start. It sways there by some millirad, on soft
// drives for seconds: what the legs know of that motion is taken off what the IMU feels.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/estimation/contact/leg_measurement.hpp"

namespace polygmap {

// Roll and pitch of a base that has what is up there, in its own axes; yaw 0.
[[nodiscard]] Mat3 level_attitude(const Vec3& up) noexcept;

class StandstillCalibration {
 public:
  struct Params {
    double duration_s = 1.0;
    double max_rate_radps = 0.05;
    double max_accel_error_mps2 = 1.0;
    double max_joint_move_rad = 0.01;
    double min_foot_force_n = 50.0;
    double min_line_s = 0.3;
    double gyro_bias_sigma_radps = 0.002;

    static void visit(auto& p, auto& field) {
      field("duration_s", p.duration_s, 0.05, 30.0, "The robot stands still for so long at the start.");
      field("max_rate_radps", p.max_rate_radps, 1e-4, 1.0,
            "Bias, noise and sway of the gyro stay below this while the robot stands.");
      field("max_accel_error_mps2", p.max_accel_error_mps2, 0.01, 10.0, "The measured gravity is off by no more.");
      field("max_joint_move_rad", p.max_joint_move_rad, 1e-4, 0.5, "No joint moves farther while the robot stands.");
      field("min_foot_force_n", p.min_foot_force_n, 0.0, 500.0, "A standing foot presses at least as hard.");
      field("min_line_s", p.min_line_s, 0.01, 10.0,
            "Gravity is the mean of what was felt for less, and the slope of its integral from then on.");
      field("gyro_bias_sigma_radps", p.gyro_bias_sigma_radps, 1e-5, 0.1,
            "What the gyro's bias is off by once found: joints play by some millirad, and their encoders do not see "
            "the base sway by that.");
    }
  };
  using Legs = std::array<LegMeasurement, kFootCount>;
  void reset(const Params& params) noexcept;
  // True when the whole duration was still but for sway. Motion or a foot in the air starts over.
  [[nodiscard]] bool try_finish(const ImuSample& imu, const JointFeedback& joints, const Legs& legs) noexcept;

  [[nodiscard]] std::uint32_t restarts() const noexcept { return restarts_; }
  [[nodiscard]] std::int64_t start_ns() const noexcept { return start_ns_; }
  [[nodiscard]] bool collecting() const noexcept { return samples_ > 0; }
  // As of the last sample. Roll and pitch from gravity, yaw 0.
  [[nodiscard]] Mat3 odom_R_base() const noexcept;
  [[nodiscard]] double gravity_mps2() const noexcept { return first_base_g_mps2().norm(); }
  // Once finished.
  [[nodiscard]] Vec3 gyro_bias_radps() const noexcept { return turn_.slope(times_); }
  [[nodiscard]] double gyro_bias_sigma_radps() const noexcept { return params_.gyro_bias_sigma_radps; }
  [[nodiscard]] Vec3 odom_v_base_mps() const noexcept;

 private:
  // A straight line through samples over time, by least squares.
  struct Times {
    double count = 0.0, sum_s = 0.0, sum_s2 = 0.0;
    [[nodiscard]] double spread() const noexcept { return count * sum_s2 - math::square(sum_s); }
  };
  struct Line {
    Vec3 sum = Vec3::Zero(), sum_by_time = Vec3::Zero();
    void add(double time_s, const Vec3& value) noexcept {
      sum += value;
      sum_by_time += time_s * value;
    }
    [[nodiscard]] Vec3 slope(const Times& t) const noexcept {
      return (t.count * sum_by_time - t.sum_s * sum) / t.spread();
    }
    [[nodiscard]] Vec3 at(const Times& t, double time_s) const noexcept {
      return sum / t.count + (time_s - t.sum_s / t.count) * slope(t);
    }
  };
  void begin(const ImuSample& imu, const JointFeedback& joints, const Legs& legs) noexcept;
  [[nodiscard]] Vec3 first_base_g_mps2() const noexcept;

  Params params_;
  // In axes of the base as it was at the first sample, from there on.
  Vec3 felt_rad_ = Vec3::Zero(), felt_mps_ = Vec3::Zero();  // integrals of what the IMU feels
  Mat3 first_base_R_base_ = Mat3::Identity();               // by the legs
  Vec3 first_mps2_{0.0, 0.0, kGravity_mps2};                // felt at that sample
  Times times_;
  Line turn_, velocity_;  // these integrals less the motion that the legs tell
  JointVector first_q_rad_ = JointVector::Zero();
  std::array<Mat3, kFootCount> first_base_R_sole_{Mat3::Identity(), Mat3::Identity()};
  double samples_ = 0.0;
  double time_s_ = 0.0;  // of the last sample
  std::int64_t start_ns_ = 0;
  std::uint32_t restarts_ = 0;
};

}  // namespace polygmap
