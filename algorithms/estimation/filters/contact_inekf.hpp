// SPDX-License-Identifier: Apache-2.0
// Attitude, velocity and position of the base, the biases of gyro and accelerometer, the places and rotations of the
// soles, where lidar odometry's world lies, and by how much the IMU is late: from the IMU, the standing feet, known
// heights of the ground and lidar odometry.
//
// An error-state filter whose errors are right-invariant (in odom axes: R = exp(e) R_est, v = exp(e) v_est + e_v, ...):
// its propagation and rows do not depend on the estimate, so an estimate gained wrongly does not feign information,
// yaw's and position's least of all. What eqs (1)-(4) say, an IMU that predicts, feet that rest and treads of known
// height, with one covariance instead of one per axis. All noises are densities: the rate of samples does not matter.
// Source: Hartley, Ghaffari, Eustice, Grizzle, "Contact-aided invariant extended Kalman filtering for robot state
// estimation", IJRR 2020, sections 4-6; soles, heights, lidar's world and the delay: own derivation.
#pragma once

#include <algorithm>

#include "algorithms/estimation/contact/contacts.hpp"
#include "algorithms/estimation/contact/leg_history.hpp"
#include "algorithms/estimation/filters/row_batch.hpp"
#include "algorithms/estimation/filters/stance_walk.hpp"
#include "algorithms/estimation/quality/innovation.hpp"

namespace polygmap {

struct KnownHeight {
  double odom_z_m = 0.0;
  double sigma_m = -1.0;  // negative: unknown
};

// One sigma each, of one pose of lidar odometry's; world_tilt_rad: its world is level but for that.
struct LidarSigmas {
  double position_m = 0.0, yaw_rad = 0.0, world_tilt_rad = 0.0;
};

class ContactInEkf {
 public:
  struct Params {
    double gyro_noise_radprs = 1e-3;
    double accel_noise_mpsrs = 0.015;
    double accel_noise_rs = 0.006;
    double accel_step_share = 0.25;
    double lost_accel_noise_mpsrs = 2.0;
    double lost_gyro_noise_radprs = 0.1;
    double gyro_bias_walk_radpsrs = 1e-4;
    double accel_bias_walk_mps2rs = 1e-3;
    double foot_sigma_m = 1.2e-3;
    double sole_sigma_rad = 1.5e-3;
    double foot_correlation_s = 0.01;
    StanceWalk::Params stance;
    double height_correlation_s = 4.0;
    double outlier_sigmas = 5.0;
    double turn_lever_m = 0.5;
    double motion_s = 0.1;
    double imu_delay_sigma_s = 0.0015;
    double imu_delay_memory_s = 4.0;
    double imu_delay_start_sigma_s = 0.0015;

    static void visit(auto& p, auto& field) {
      field("gyro_noise_radprs", p.gyro_noise_radprs, 1e-6, 0.1,
            "Noise of the gyro and of whatever it is bolted to, as far as the filter is concerned.");
      field("accel_noise_mpsrs", p.accel_noise_mpsrs, 1e-5, 1.0, "The same of the accelerometer, of a base at rest.");
      field("accel_noise_rs", p.accel_noise_rs, 0.0, 1.0,
            "Scale, mount, timing and vibration add so much for each m/s^2 that the base accelerates.");
      field("accel_step_share", p.accel_step_share, 0.0, 10.0,
            "Between two samples the acceleration is off by this share of its change.");
      field("lost_accel_noise_mpsrs", p.lost_accel_noise_mpsrs, 0.01, 20.0,
            "The acceleration of a base that nobody feels.");
      field("lost_gyro_noise_radprs", p.lost_gyro_noise_radprs, 0.001, 1.0,
            "The turning of a walking base that nobody feels: 0.03 rad in 0.1 s.");
      field("gyro_bias_walk_radpsrs", p.gyro_bias_walk_radpsrs, 0.0, 0.01, "Random walk of the gyro's bias.");
      field("accel_bias_walk_mps2rs", p.accel_bias_walk_mps2rs, 0.0, 0.1, "Random walk of the accelerometer's bias.");
      field("foot_sigma_m", p.foot_sigma_m, 1e-6, 0.1, "Error of a foot's place by its leg.");
      field("sole_sigma_rad", p.sole_sigma_rad, 1e-6, 0.1, "Error of a sole's attitude by its leg.");
      field("foot_correlation_s", p.foot_correlation_s, 1e-4, 1.0,
            "Both err alike for so long, however many samples there are in it.");
      field("stance", p.stance);
      field("height_correlation_s", p.height_correlation_s, 0.002, 100.0,
            "A tread's height errs alike in every step of this time.");
      field("outlier_sigmas", p.outlier_sigmas, 0.5, 100.0, "Rows farther out weigh less, in proportion (Huber).");
      field("turn_lever_m", p.turn_lever_m, 0.0, 2.0,
            "Turning counts as the speed that it gives a point so far from the base.");
      field("motion_s", p.motion_s, 1e-3, 10.0, "Turning and acceleration of the base are averaged over this.");
      field("imu_delay_sigma_s", p.imu_delay_sigma_s, 0.0, 0.05, "The IMU is later than the legs, by so much usually.");
      field("imu_delay_memory_s", p.imu_delay_memory_s, 0.1, 1e4,
            "What is known of its delay is forgotten in this time.");
      field("imu_delay_start_sigma_s", p.imu_delay_start_sigma_s, 0.0, 0.05,
            "The start may be that of another time than the first IMU sample's.");
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
  // gyro_radps, accel_mps2: of the IMU then.
  void initialise(const Start& start, const std::array<LegMeasurement, kFootCount>& legs,
                  const Vec3& gyro_radps = Vec3::Zero(), const Vec3& accel_mps2 = Vec3{0, 0, kGravity_mps2}) noexcept;

  enum class Motion : std::uint8_t {
    kFelt,
    kVelocityLost,  // felt, but no foot has rested for so long that the velocity is not known
    kUnfelt         // the IMU is silent: rates are guesses
  };
  void predict(const Vec3& gyro_radps, const Vec3& accel_mps2, double dt_s, Motion motion) noexcept;
  // A foot that does not stand is anchored anew. legs: as they were legs_delay_s ago, nearly when the IMU felt what it
  // tells now; what is left of the IMU's delay is estimated.
  void correct_by_feet(const LegHistory::Moment& legs, double legs_delay_s,
                       const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept;

  // Eq. (4): the ground's height under feet that stand, where it is known.
  void correct_by_heights(const std::array<KnownHeight, kFootCount>& heights,
                          const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept;

  // Where lidar odometry's world lies is a clone of the base's place and heading at the moment of a tie (stochastic
  // cloning): later poses of that world are relative to it. It is level: the tilt of its poses is that of its mount,
  // too. age_s: of the pose by which it is tied; odom_T_base is the state's of that time.
  void tie_lidar(const Transform& odom_T_base, const Transform& odom_T_lidar, double age_s,
                 const LidarSigmas& sigmas) noexcept;
  // That world drifts.
  void drift_lidar(double position_m2, double rotation_rad2) noexcept;
  // A pose of it: three rows of position and one of yaw. age_s: of the pose, odom_T_base is the state's of that time.
  struct LidarRows {
    Eigen::Vector4d innovation = Eigen::Vector4d::Zero();  // x, y, z in m, yaw in rad
    double ratio = 0.0;                                    // its square over its variance, per row
  };
  [[nodiscard]] LidarRows lidar_rows(const Transform& odom_T_base, const Transform& lidar_T_base, double age_s,
                                     const LidarSigmas& sigmas) const noexcept;
  // rows: as lidar_rows has just told them.
  void correct_by_lidar(const Transform& odom_T_base, const LidarRows& rows, double age_s,
                        const LidarSigmas& sigmas) noexcept;

  [[nodiscard]] const Mat3& odom_R_base() const noexcept { return odom_R_base_; }
  [[nodiscard]] const Vec3& odom_v_base_mps() const noexcept { return odom_v_base_mps_; }
  [[nodiscard]] const Vec3& odom_p_base_m() const noexcept { return odom_p_base_m_; }
  [[nodiscard]] const Vec3& gyro_bias_radps() const noexcept { return gyro_bias_radps_; }
  [[nodiscard]] const Vec3& accel_bias_mps2() const noexcept { return accel_bias_mps2_; }
  // The state is that of so long ago: the IMU is late by it, against the legs.
  [[nodiscard]] double imu_delay_s() const noexcept { return imu_delay_s_; }
  // Of late.
  [[nodiscard]] const Vec3& odom_a_base_mps2() const noexcept { return odom_a_base_mps2_; }
  [[nodiscard]] double gravity_mps2() const noexcept { return gravity_mps2_; }
  // By which what the IMU feels changed with the last prediction.
  [[nodiscard]] const Vec3& accel_step_mps2() const noexcept { return motion_.accel_step_mps2; }
  // Of roll and pitch, one sigma, the larger one; and of yaw.
  [[nodiscard]] double tilt_sigma_rad() const noexcept {
    return math::sqrt(std::max(P_(kAttitude, kAttitude), P_(kAttitude + 1, kAttitude + 1)));
  }
  [[nodiscard]] double yaw_sigma_rad() const noexcept { return math::sqrt(P_(kAttitude + 2, kAttitude + 2)); }
  // Of position, velocity and attitude in odom axes, in this order: of what is true minus what is estimated.
  [[nodiscard]] Eigen::Matrix<double, 9, 9> covariance() const noexcept;
  [[nodiscard]] double velocity_sigma_mps() const noexcept;  // of the axis that is known worst
  // Of the last correction.
  [[nodiscard]] const NormalisedRows& position_rows() const noexcept { return rows_.position; }
  [[nodiscard]] const NormalisedRows& sole_rows() const noexcept { return rows_.sole; }
  [[nodiscard]] const NormalisedRows& height_rows() const noexcept { return rows_.height; }
  // Mean over the standing feet and their axes: the square of an innovation that is averaged over some milliseconds,
  // over the variance that the filter expects of it. Negative: no foot stands.
  [[nodiscard]] double mean_innovation_ratio() const noexcept { return mean_innovation_ratio_; }
  [[nodiscard]] std::uint32_t outliers() const noexcept { return outliers_; }

 private:
  static constexpr int kStates = 34;
  enum Index : int {
    kAttitude = 0,
    kVelocity = 3,
    kPosition = 6,
    kContact = 9,
    kMoving = 15,  // what prediction changes ends here
    kGyroBias = 15,
    kAccelBias = 18,
    kSoleRotation = 21,
    kLidarRotation = 27,
    kLidarPosition = 30,
    kImuDelay = 33
  };
  using Covariance = Eigen::Matrix<double, kStates, kStates>;
  using Vector = Eigen::Matrix<double, kStates, 1>;

  void predict_covariance(double gyro_rad2ps, double accel_m2ps3, double dt_s) noexcept;
  void anchor(std::size_t foot, const LegMeasurement& leg) noexcept;
  using FeetBatch = RowBatch<kStates, 6 * kFootCount>;
  // State at `plus` minus state at `minus`, three rows, and their share in the IMU's delay.
  struct Difference {
    int plus, minus;
    Vec3 per_delay;
  };
  // What is left of an innovation after the rows before it, and the variance per axis that the state's errors give it.
  struct Innovation {
    Vec3 value;
    double variance;
  };
  // variance: of each of the three measurements.
  Innovation take(const Difference& difference, const Vec3& innovation, double variance, FeetBatch& batch,
                  NormalisedRows& rows) noexcept;
  void average_innovation(std::size_t foot, const Innovation& innovation, double dt_s) noexcept;
  void apply(const Vector& error) noexcept;
  static constexpr int kYawRow = 3;
  struct LidarRow {
    int index = 0;
    std::array<int, 2> turns{};
    std::array<double, 2> lever_m{};
    double age_s = 0.0;
    [[nodiscard]] double operator()(const Vector& x) const noexcept;
    [[nodiscard]] Vector times(const Covariance& P) const noexcept;
  };
  [[nodiscard]] static LidarRow lidar_row(int index, const Vec3& odom_p_base_m, double age_s) noexcept;
  Params params_;
  Mat3 odom_R_base_ = Mat3::Identity();
  Vec3 odom_v_base_mps_ = Vec3::Zero();
  Vec3 odom_p_base_m_ = Vec3::Zero();
  Vec3 gyro_bias_radps_ = Vec3::Zero();
  Vec3 accel_bias_mps2_ = Vec3::Zero();
  std::array<Vec3, kFootCount> odom_p_contact_m_{Vec3::Zero(), Vec3::Zero()};
  StanceWalk stance_;
  std::array<Vec3, kFootCount> innovation_m_{Vec3::Zero(), Vec3::Zero()};  // averaged
  double mean_innovation_ratio_ = -1.0;
  struct {
    double turn_rad2ps2 = 0.0, accel_m2ps4 = 0.0;  // of the base, mean squares of late
    Vec3 accel_mps2 = Vec3::Zero();                // as the IMU felt it in the last prediction, ...
    Vec3 accel_step_mps2 = Vec3::Zero();           // ... against the one before
  } motion_;
  std::array<Mat3, kFootCount> odom_R_foot_{Mat3::Identity(), Mat3::Identity()};
  Transform odom_T_lidar_;  // its world's
  double imu_delay_s_ = 0.0;
  Vec3 odom_a_base_mps2_ = Vec3::Zero();
  Covariance P_ = Covariance::Zero();
  double gravity_mps2_ = kGravity_mps2;
  struct {
    NormalisedRows position, sole, height;
  } rows_;  // of the last correction
  std::uint32_t outliers_ = 0;
};

}  // namespace polygmap
