// SPDX-License-Identifier: Apache-2.0
// State estimation as one stage: samples in as they arrive, StateEstimate out once per 2 ms.
#pragma once

#include <algorithm>

#include "algorithms/estimation/calibration/imu_mount.hpp"
#include "algorithms/estimation/calibration/resting_accel.hpp"
#include "algorithms/estimation/calibration/standstill.hpp"
#include "algorithms/estimation/leg_sensing.hpp"
#include "algorithms/estimation/proprioceptive_odometry.hpp"
#include "algorithms/estimation/state_history.hpp"

namespace polygmap {

class Estimator {
 public:
  // The IMU alone carries the base on for so long, as a swing beside a mute leg takes: a tilt that is off by 5 mrad
  // makes 50 mm/s of it. From then on a mute leg that stands counts all the same: its joints hold, or are where the
  // sole is level.
  static constexpr std::int64_t kAlone_ns = kNsPerS;
  struct Params : ProprioceptiveOdometry::Params {
    StandstillCalibration::Params standstill;
    ImuMount::Params imu_mount;
    ContactEstimator::Params contacts;
    LegSensing::Params legs;
    bool imu_of_moments = false;
    std::int64_t max_lead_ns = 10 * kNsPerMs;
    double max_height_error_m = 0.03;
    double floor_sigma_m = 0.003;
    double first_tilt_sigma_rad = 0.015;
    std::int64_t rest_ns = 100 * kNsPerMs;
    double rested_tilt_sigma_rad = 0.006;
    double first_velocity_sigma_mps = 0.02;
    double first_gyro_bias_sigma_radps = 0.005;

    static void visit(auto& p, auto& field) {
      ProprioceptiveOdometry::Params::visit(p, field);
      field("standstill", p.standstill);
      field("imu_mount", p.imu_mount);
      field("contacts", p.contacts);
      field("legs", p.legs);
      field("imu_of_moments", p.imu_of_moments,
            "An IMU sample holds for its moment, not for the time since the last: the mean of both ends counts.");
      field("max_lead_ns", p.max_lead_ns, 0, 1000000000,
            "A stamp may lie so far after now: frames caught up run up to 6 ms late.");
      field("max_height_error_m", p.max_height_error_m, 0.001, 1.0,
            "A tread's height this far from the sole on it is refused.");
      field("floor_sigma_m", p.floor_sigma_m, 1e-5, 1.0, "Height of the floor under the feet at the start.");
      field("first_tilt_sigma_rad", p.first_tilt_sigma_rad, 1e-4, 0.2, "Tilt as a single acceleration tells it.");
      field("rest_ns", p.rest_ns, 0, kNsPerS, "The IMU is listened to for so long before anything is commanded.");
      field("rested_tilt_sigma_rad", p.rested_tilt_sigma_rad, 1e-4, 0.2,
            "Tilt as the mean over `rest_ns` tells it: the accelerometer has a bias.");
      field("first_velocity_sigma_mps", p.first_velocity_sigma_mps, 1e-3, 1.0, "Velocity as the first legs tell it.");
      field("first_gyro_bias_sigma_radps", p.first_gyro_bias_sigma_radps, 1e-5, 0.1,
            "Bias of the gyro, of which nothing is known before the standstill.");
    }
  };
  struct Counters {
    std::int64_t stamp_ns = 0;  // of the last tick's state
    std::uint32_t ticks = 0;
    std::uint32_t imu_invalid = 0;  // not finite or out of range
    std::uint32_t imu_stale = 0;    // no newer stamp than the last
    std::uint32_t imu_future = 0;   // stamped later than now
    std::uint32_t gaps = 0;         // longer than max_step_s
    std::uint32_t standstill_restarts = 0;
    std::uint32_t height_taken = 0;
    std::uint32_t height_invalid = 0;
    std::uint32_t height_rejected = 0;  // disagreed by more than max_height_error_m
    std::array<std::uint32_t, kLioVerdictCount> lio{};
    [[nodiscard]] std::uint32_t lio_of(LioVerdict verdict) const noexcept {
      return lio[static_cast<std::size_t>(verdict)];
    }
  };

  // robot: outlives the estimator.
  void reset(const Params& params, const RobotModel& robot) noexcept;

  // Samples as they arrive, the oldest first. A bad, stale or future one is counted and left out. IMU samples of one
  // tick count as their mean.
  void add_imu(const ImuSample& imu, std::int64_t now_ns) noexcept;
  void add_joints(const JointFeedback& joints, std::int64_t now_ns) noexcept;
  // The same for whoever knows the legs without joints. Stamps increase. A standstill is not seen in them: start().
  void add_legs(const LegSample& legs) noexcept;
  // Instead of the standstill: the state at the newest sample. There are legs by now; a tick from here on moves it.
  void start(const ContactInEkf::Start& start) noexcept;
  // One tick, to the newest sample. planned_stance: the feet the gait believes to stand. With one sensor silent the
  // other one carries the state on, and oldest_input_ns says since when; with both silent the state stays as it is.
  void tick(const std::array<bool, kFootCount>& planned_stance) noexcept;
  // A pose as it arrives. Counted by its verdict.
  void add_lio(const LioSample& sample, std::int64_t now_ns) noexcept;
  // At touch-down, once: height in odom of the tread under that foot as the map has it, until the foot lifts.
  void set_tread_height(Foot foot, double odom_z_m, double sigma_m) noexcept;

  [[nodiscard]] const StateEstimate& state() const noexcept { return state_; }
  [[nodiscard]] const LegSensing& leg_sensing() const noexcept { return leg_sensing_; }
  [[nodiscard]] std::int64_t newest_imu_ns() const noexcept { return imu_.newest.stamp_ns; }  // accepted; 0: none yet
  // Until the filters begin; it is what they begin with.
  [[nodiscard]] const RestingAccel& resting_accel() const noexcept { return imu_.resting; }
  // The state at a stamp of the last half second. False, and out untouched, outside, before initialisation, and where a
  // sensor was silent for longer than max_step_s.
  [[nodiscard]] bool try_state_at(std::int64_t stamp_ns, StateEstimate& out) const noexcept {
    return ring_.try_at(stamp_ns, out);
  }
  // Of that state; stamped with it.
  [[nodiscard]] const EstimateQuality& quality() const noexcept { return quality_; }
  [[nodiscard]] const ProprioceptiveOdometry& odometry() const noexcept { return odometry_; }
  [[nodiscard]] const std::array<FootContact, kFootCount>& contacts() const noexcept { return contacts_.feet(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  struct Imu {
    bool any = false;
    ImuSample newest;                    // accepted
    ImuSample mean;                      // of the tick's; stamped as the newest
    std::uint32_t new_count = 0;         // accepted since the last tick
    RestingAccel resting;                // until the filters begin
    ImuMount mount;                      // until the standstill is over
    Mat3 base_R_imu = Mat3::Identity();  // as configured, then as that has found it
  };
  struct Legs {
    bool any = false;
    bool fresh = false;  // since the last tick
    LegSample sample;
  };
  struct Origin {
    Transform odom_T_base;  // stood still there until initialised_ns
    std::int64_t initialised_ns = 0;
  };
  void take_legs(const std::array<bool, kFootCount>& planned_stance) noexcept;
  // Of the legs that count as measurements. One that is again is put where kinematics has it, as if it had just landed.
  [[nodiscard]] std::array<FootContact, kFootCount> measured_contacts(std::int64_t now_ns, bool new_legs) noexcept;
  // Before the standstill is over: true when the filters begin at these samples, either from what it found or from a
  // first guess to balance by.
  [[nodiscard]] bool try_begin() noexcept;
  void turn_imu(const Mat3& base_R_felt, Mat3& odom_R_base) noexcept;
  void begin(const ContactInEkf::Start& start) noexcept;
  void publish(std::int64_t now_ns) noexcept;
  [[nodiscard]] std::int64_t newest_input_ns() const noexcept {
    return std::max(imu_.newest.stamp_ns, legs_.sample.stamp_ns);
  }

  Params params_;
  const RobotModel* robot_ = nullptr;
  Counters counters_;
  LegSensing leg_sensing_;
  StandstillCalibration standstill_;
  ContactEstimator contacts_;
  ProprioceptiveOdometry odometry_;
  StateHistory ring_;
  StateEstimate state_;
  EstimateQuality quality_;
  Imu imu_;
  Legs legs_;
  struct {
    bool ticked = false;
    bool begun = false;    // the filters have a state,
    bool runs = false;     // and carry it on, though the standstill is not over,
    bool has_run = false;  // or did so before
  } known_;
  ProprioceptiveOdometry::Heights heights_;
  std::array<bool, kFootCount> stood_{};
  std::array<bool, kFootCount> was_measured_{true, true};
  bool alone_ = false;         // no leg without a mute drive has stood for kAlone_ns, nor since
  std::int64_t stood_ns_ = 0;  // when a leg that counts as a measurement did last
  Origin origin_;
};

}  // namespace polygmap
