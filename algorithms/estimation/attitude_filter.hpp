// SPDX-License-Identifier: Apache-2.0
// Attitude of the base in odom and the gyro's bias, from the gyro, the standing feet and gravity.
//
// A standing foot does not turn: the attitude of the base against it, by leg kinematics, tells the bias from a true
// turn, yaw included. Gravity is believed slowly only: the accelerometer's own error is 0.5 deg, a constant tilt turns
// everything alike, but 1 mrad of changing tilt moves a foot by 0.8 mm.
#pragma once

#include <algorithm>

#include "algorithms/estimation/contacts.hpp"

namespace polygmap {

class AttitudeFilter {
 public:
  struct Params {
    double gyro_noise_radprs = 1e-4;         // rad/sqrt(s); 2e-3 rad/s at 500 Hz is 0.9e-4
    double bias_walk_radpsrs = 5e-6;         // rad/s/sqrt(s)
    double initial_bias_sigma_radps = 2e-4;  // after one second of standstill
    double foot_sigma_rad = 1e-3;            // of one kinematic attitude, encoder noise
    double foot_walk_radprs = 1e-3;          // rad/sqrt(s): creep of a loaded foot and kinematic error as the legs move
    double gravity_window_s = 0.5;           // specific force is averaged over this, less the change of velocity
    double gravity_sigma_rad = 1e-2;         // of one window
    double max_gravity_error_mps2 = 0.5;     // a window whose mean is further off is not gravity
  };
  void reset(const Params& params) noexcept;
  void initialise(const Mat3& odom_R_base, const Vec3& gyro_bias_radps, double gravity_mps2,
                  const std::array<Mat3, kFootCount>& base_R_sole) noexcept;

  void predict(const Vec3& gyro_radps, double dt_s) noexcept;
  // base_R_sole by leg kinematics. A foot that does not stand for certain is anchored anew.
  void correct_by_feet(const std::array<Mat3, kFootCount>& base_R_sole,
                       const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept;
  // accel: of the IMU; odom_v: of the base filter, so that a mean over the window holds no true acceleration.
  void correct_by_gravity(const Vec3& accel_mps2, const Vec3& odom_v_mps, double dt_s, std::int64_t stamp_ns) noexcept;

  [[nodiscard]] const Mat3& odom_R_base() const noexcept { return odom_R_base_; }
  [[nodiscard]] const Vec3& gyro_bias_radps() const noexcept { return bias_radps_; }
  // Of roll and pitch, one sigma, the larger one; grown since the start.
  [[nodiscard]] double tilt_sigma_rad() const noexcept {
    return math::sqrt(std::max(P_[0](kAttitude, kAttitude), P_[1](kAttitude, kAttitude)));
  }
  [[nodiscard]] double gravity_mps2() const noexcept { return gravity_mps2_; }
  [[nodiscard]] std::uint32_t gravity_rejected() const noexcept { return gravity_rejected_; }

 private:
  // Per body axis: attitude, bias, left foot, right foot. The axes couple only through turning by w dt, a fraction of
  // the errors' own size: three filters of four states instead of one of twelve.
  static constexpr int kStates = 4;
  enum State : int { kAttitude, kBias, kFirstFoot };
  using AxisCovariance = Eigen::Matrix<double, kStates, kStates>;
  using AxisGain = Eigen::Matrix<double, kStates, 1>;

  // Scalar update of one axis; returns the correction of its states.
  [[nodiscard]] AxisGain correct_axis(int axis, const AxisGain& row, double innovation_rad, double variance) noexcept;
  void anchor(std::size_t foot, const Mat3& base_R_sole) noexcept;
  void apply(const std::array<AxisGain, 3>& corrections) noexcept;

  Params params_;
  Mat3 odom_R_base_ = Mat3::Identity();
  Vec3 bias_radps_ = Vec3::Zero();
  std::array<Mat3, kFootCount> odom_R_foot_{Mat3::Identity(), Mat3::Identity()};
  std::array<AxisCovariance, 3> P_{AxisCovariance::Zero(), AxisCovariance::Zero(), AxisCovariance::Zero()};
  double gravity_mps2_ = kGravity_mps2;

  Vec3 window_force_mps_ = Vec3::Zero();  // integral of specific force in odom
  Vec3 window_start_v_mps_ = Vec3::Zero();
  std::int64_t window_start_ns_ = -1;
  std::uint32_t gravity_rejected_ = 0;
};

}  // namespace polygmap
