// SPDX-License-Identifier: Apache-2.0
// Attitude of the base in odom and the biases of gyro and accelerometer, from the IMU and the standing feet.
//
// An error-state filter on SO(3) whose errors are right-invariant (in odom axes: R = exp(e) R_est, v = exp(e) v_est +
// e_v, ...): its propagation and rows do not depend on the estimate, so an estimate gained wrongly does not feign
// information, yaw's and position's least of all. Velocity, position and contacts are in it because tilt and biases
// show themselves as motion that the legs deny; eqs (1)-(4) do the rest with the attitude they are given. It also
// holds the covariance between attitude and motion, which the axis filters of eqs (1)-(4) cannot.
// Source: Hartley, Ghaffari, Eustice, Grizzle, "Contact-aided invariant extended Kalman filtering for robot state
// estimation", IJRR 2020, sections 4-6; the sole's rotation as two more states: own derivation.
#pragma once

#include <algorithm>

#include "algorithms/estimation/calibration/imu_noise.hpp"
#include "algorithms/estimation/contact/contacts.hpp"
#include "algorithms/estimation/contact/leg_measurement.hpp"
#include "algorithms/estimation/quality/innovation.hpp"

namespace polygmap {

class ContactInEkf {
 public:
  struct Params {
    double gyro_noise_radprs = 1e-4;
    double accel_noise_mpsrs = 3e-3;
    double lost_accel_noise_mpsrs = 2.0;
    double lost_gyro_noise_radprs = 0.1;
    double dynamic_accel_share = 0.02;
    double gyro_bias_walk_radpsrs = 5e-6;
    double accel_bias_walk_mps2rs = 1e-4;
    double foot_sigma_rad = 1e-3;
    double foot_walk_radprs = 1e-3;
    double contact_walk_mprs = 2e-3;
    double min_contact_walk_mprs = 3e-4;
    double full_walk_speed_mps = 0.1;
    double max_contact_walk_mprs = 2e-2;
    double whiteness_window_s = 0.2;
    double whiteness_gain_ps = 1.0;
    double whiteness_start_gain = 1.0;
    double whiteness_most_ratio = 5.0;
    double outlier_sigmas = 5.0;
    double turn_lever_m = 0.5;
    double least_load_share = 0.05;

    static void visit(auto& p, auto& field) {
      field("gyro_noise_radprs", p.gyro_noise_radprs, 1e-6, 0.1,
            "Noise of the gyro at least: 2e-3 rad/s at 500 Hz is 0.9e-4.");
      field("accel_noise_mpsrs", p.accel_noise_mpsrs, 1e-5, 1.0,
            "Noise of the accelerometer at least: 0.05 m/s^2 at 500 Hz is 2.2e-3.");
      field("lost_accel_noise_mpsrs", p.lost_accel_noise_mpsrs, 0.01, 20.0,
            "The acceleration of a base that nobody feels.");
      field("lost_gyro_noise_radprs", p.lost_gyro_noise_radprs, 0.001, 1.0,
            "The turning of a walking base that nobody feels: 0.03 rad in 0.1 s.");
      field("dynamic_accel_share", p.dynamic_accel_share, 0.0, 0.5,
            "Sampling, scale and mount falsify this share of what differs from gravity.");
      field("gyro_bias_walk_radpsrs", p.gyro_bias_walk_radpsrs, 0.0, 0.01, "Random walk of the gyro's bias.");
      field("accel_bias_walk_mps2rs", p.accel_bias_walk_mps2rs, 0.0, 0.1, "Random walk of the accelerometer's bias.");
      field("foot_sigma_rad", p.foot_sigma_rad, 1e-5, 0.1, "Encoder noise of one attitude of a sole.");
      field("foot_walk_radprs", p.foot_walk_radprs, 1e-6, 1.0,
            "A loaded foot's creep and the kinematic error turn its attitude like this as the legs move.");
      field("contact_walk_mprs", p.contact_walk_mprs, 1e-5, 1.0,
            "A loaded foot's place walks like this at the start; then the walk is measured.");
      field("min_contact_walk_mprs", p.min_contact_walk_mprs, 1e-6, 0.1, "The measured walk is at least this.");
      field("full_walk_speed_mps", p.full_walk_speed_mps, 0.001, 2.0,
            "A contact walks less when the base moves more slowly, turning included.");
      field("max_contact_walk_mprs", p.max_contact_walk_mprs, 1e-5, 10.0, "The measured walk is at most this.");
      field.ordered("min_contact_walk_mprs", "max_contact_walk_mprs");
      field("whiteness_window_s", p.whiteness_window_s, 0.002, 10.0,
            "The walk is right when innovations averaged over this time are white.");
      field("whiteness_gain_ps", p.whiteness_gain_ps, 0.0, 20.0, "Gain of the walk's logarithm in the long run.");
      field("whiteness_start_gain", p.whiteness_start_gain, 0.0, 10.0,
            "Gain of the walk's logarithm at the start, over the time measured.");
      field("whiteness_most_ratio", p.whiteness_most_ratio, 1.01, 1000.0,
            "Innovations count as no more than this times what white ones are.");
      field("outlier_sigmas", p.outlier_sigmas, 0.5, 100.0, "Rows farther out weigh less, in proportion (Huber).");
      field("turn_lever_m", p.turn_lever_m, 0.0, 2.0,
            "Turning counts as the speed that it gives a point so far from the base.");
      field("least_load_share", p.least_load_share, 0.001, 1.0,
            "A foot that carries less, by load and by how sure its contact is, walks no more than one that carries "
            "this.");
    }
  };
  // One sigma each, of what is known at the start.
  struct Start {
    Mat3 odom_R_base = Mat3::Identity();
    Vec3 odom_p_base_m = Vec3::Zero();
    Vec3 odom_v_base_mps = Vec3::Zero();
    Vec3 gyro_bias_radps = Vec3::Zero();
    Vec3 accel_bias_mps2 = Vec3::Zero();
    double gravity_mps2 = kGravity_mps2;
    double tilt_sigma_rad = 1e-4;
    double yaw_sigma_rad = 1e-4;
    double position_sigma_m = 1e-4;
    double velocity_sigma_mps = 1e-3;
    double gyro_bias_sigma_radps = 2e-4;
    double accel_bias_sigma_mps2 = 0.003;
  };
  void reset(const Params& params) noexcept;
  void initialise(const Start& start, const std::array<LegMeasurement, kFootCount>& legs) noexcept;

  enum class Motion : std::uint8_t {
    kFelt,
    kVelocityLost,  // felt, but no foot has rested for so long that the velocity is not known
    kUnfelt         // the IMU is silent: rates are guesses
  };
  // noise: as measured of this IMU.
  void predict(const Vec3& gyro_radps, const Vec3& accel_mps2, double dt_s, Motion motion,
               const ImuNoiseDensity& noise = {}) noexcept;
  // A foot that does not stand is anchored anew.
  void correct_by_feet(const std::array<LegMeasurement, kFootCount>& legs,
                       const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept;

  [[nodiscard]] const Mat3& odom_R_base() const noexcept { return odom_R_base_; }
  [[nodiscard]] const Vec3& odom_v_base_mps() const noexcept { return odom_v_base_mps_; }
  [[nodiscard]] const Vec3& odom_p_base_m() const noexcept { return odom_p_base_m_; }
  [[nodiscard]] const Vec3& gyro_bias_radps() const noexcept { return gyro_bias_radps_; }
  [[nodiscard]] const Vec3& accel_bias_mps2() const noexcept { return accel_bias_mps2_; }
  [[nodiscard]] double gravity_mps2() const noexcept { return gravity_mps2_; }
  // Of roll and pitch, one sigma, the larger one; and of yaw.
  [[nodiscard]] double tilt_sigma_rad() const noexcept {
    return math::sqrt(std::max(P_(kAttitude, kAttitude), P_(kAttitude + 1, kAttitude + 1)));
  }
  [[nodiscard]] double yaw_sigma_rad() const noexcept { return math::sqrt(P_(kAttitude + 2, kAttitude + 2)); }
  // Of position, velocity and attitude in odom axes, in this order: of what is true minus what is estimated.
  [[nodiscard]] Eigen::Matrix<double, 9, 9> covariance() const noexcept;
  [[nodiscard]] double velocity_sigma_mps() const noexcept;  // of the axis that is known worst
  // Of the last correction.
  [[nodiscard]] const NormalisedRows& position_rows() const noexcept { return position_rows_; }
  [[nodiscard]] const NormalisedRows& sole_rows() const noexcept { return sole_rows_; }
  // Random walk of a resting contact, m/sqrt(s), as measured.
  [[nodiscard]] double contact_walk_mprs() const noexcept { return contact_walk_mprs_; }
  [[nodiscard]] std::uint32_t outliers() const noexcept { return outliers_; }

 private:
  static constexpr int kStates = 27;
  enum Index : int {
    kAttitude = 0,
    kVelocity = 3,
    kPosition = 6,
    kGyroBias = 9,
    kAccelBias = 12,
    kContact = 15,
    kSoleRotation = 21
  };
  using Covariance = Eigen::Matrix<double, kStates, kStates>;
  using Vector = Eigen::Matrix<double, kStates, 1>;

  void predict_covariance(double gyro_noise_radprs, double accel_noise_mpsrs, double dt_s) noexcept;
  void anchor(std::size_t foot, const LegMeasurement& leg) noexcept;
  // Three rows: state at `plus` minus state at `minus` is innovation, each of this variance.
  void correct(int plus, int minus, const Vec3& innovation, double variance, NormalisedRows& rows) noexcept;
  void apply(const Vector& error) noexcept;
  // A foot rolls and creeps as long as its leg moves, by more or less from robot to robot. Too small a walk shows as
  // innovations that keep their sign.
  void measure_walk(std::size_t foot, const Vec3& innovation_m, double variance_m2, double dt_s) noexcept;

  Params params_;
  Mat3 odom_R_base_ = Mat3::Identity();
  Vec3 odom_v_base_mps_ = Vec3::Zero();
  Vec3 odom_p_base_m_ = Vec3::Zero();
  Vec3 gyro_bias_radps_ = Vec3::Zero();
  Vec3 accel_bias_mps2_ = Vec3::Zero();
  std::array<Vec3, kFootCount> odom_p_contact_m_{Vec3::Zero(), Vec3::Zero()};
  struct Whiteness {
    Vec3 mean_m = Vec3::Zero();
    double age_s = 0.0;
  };
  std::array<Whiteness, kFootCount> whiteness_{};
  double contact_walk_mprs_ = 0.0;
  double pace_ = 1.0;         // share of that walk at the base's speed
  double walk_time_s_ = 0.0;  // measured for so long
  std::array<Mat3, kFootCount> odom_R_foot_{Mat3::Identity(), Mat3::Identity()};
  Covariance P_ = Covariance::Zero();
  double gravity_mps2_ = kGravity_mps2;
  NormalisedRows position_rows_, sole_rows_;
  std::uint32_t outliers_ = 0;
};

}  // namespace polygmap
