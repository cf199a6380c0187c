// SPDX-License-Identifier: Apache-2.0
// State estimation as one stage: samples in as they arrive, StateEstimate out once per 2 ms.
#pragma once

#include "algorithms/estimation/calibration/encoder_offsets.hpp"
#include "algorithms/estimation/calibration/standstill.hpp"
#include "algorithms/estimation/contact/force_inference.hpp"
#include "algorithms/estimation/proprioceptive_odometry.hpp"
#include "algorithms/estimation/state_history.hpp"

namespace polygmap {

class Estimator {
 public:
  struct Params : ProprioceptiveOdometry::Params {
    StandstillCalibration::Params standstill;
    ContactEstimator::Params contacts;
    EncoderOffsets::Params encoders;
    bool infer_forces = false;
    ForceInference::Params forces;
    double max_torque_nm = 1000.0;
    double max_joint_rad = 4.0;
    double max_joint_speed_radps = 15.0;
    double joint_slack_rad = 0.01;
    double max_force_n = 5000.0;
    std::int64_t max_lead_ns = 10 * kNsPerMs;
    double max_height_error_m = 0.03;
    double floor_sigma_m = 0.003;

    static void visit(auto& p, auto& field) {
      ProprioceptiveOdometry::Params::visit(p, field);
      field("standstill", p.standstill);
      field("contacts", p.contacts);
      field("encoders", p.encoders);
      field("infer_forces", p.infer_forces, "Foot forces come from joint torques, since no sensor measures them.");
      field("forces", p.forces);
      field("max_torque_nm", p.max_torque_nm, 1.0, 100000.0, "A joint sample of a higher torque is invalid.");
      field("max_joint_rad", p.max_joint_rad, 1.0, 100.0, "A joint sample of a larger angle is invalid.");
      field("max_joint_speed_radps", p.max_joint_speed_radps, 0.1, 1000.0,
            "A faster joint sample is invalid, also against the last one: a single wrong angle is not a motion.");
      field("joint_slack_rad", p.joint_slack_rad, 0.0, 1.0,
            "An encoder may jump by this besides what the joint's speed allows.");
      field("max_force_n", p.max_force_n, 100.0, 1e6, "A foot that presses harder makes the sample invalid.");
      field("max_lead_ns", p.max_lead_ns, 0, 1000000000,
            "A stamp may lie so far after now: frames caught up run up to 6 ms late.");
      field("max_height_error_m", p.max_height_error_m, 0.001, 1.0,
            "A tread's height this far from the sole on it is refused.");
      field("floor_sigma_m", p.floor_sigma_m, 1e-5, 1.0, "Height of the floor under the feet at the start.");
    }
  };
  struct Counters {
    std::int64_t stamp_ns = 0;  // of the last tick's state
    std::uint32_t ticks = 0;
    std::uint32_t imu_invalid = 0;  // not finite or out of range
    std::uint32_t imu_stale = 0;    // no newer stamp than the last
    std::uint32_t imu_future = 0;   // stamped later than now
    std::uint32_t joints_invalid = 0;
    std::uint32_t joints_stale = 0;
    std::uint32_t joints_future = 0;
    std::uint32_t joints_jump = 0;  // moved faster than a joint can
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
  // One tick, to the newest sample. planned_stance: the feet the gait believes to stand. With one sensor silent the
  // other one carries the state on, and oldest_input_ns says since when; with both silent the state stays as it is.
  void tick(const std::array<bool, kFootCount>& planned_stance) noexcept;
  // A pose as it arrives. Counted by its verdict.
  void add_lio(const LioSample& sample, std::int64_t now_ns) noexcept;
  // At touch-down, once: height in odom of the tread under that foot as the map has it, until the foot lifts.
  void set_tread_height(Foot foot, double odom_z_m, double sigma_m) noexcept;

  [[nodiscard]] const StateEstimate& state() const noexcept { return state_; }
  // The last accepted feedback, its angles without encoder_offset_rad(), its forces inferred where they are not sensed;
  // has_joints() is false before the first.
  [[nodiscard]] const JointFeedback& joints() const noexcept { return joints_; }
  [[nodiscard]] bool has_joints() const noexcept { return has_joints_; }
  [[nodiscard]] const JointVector& encoder_offset_rad() const noexcept { return encoders_.offset_rad(); }
  // A command in angles of joints() or of the state, to what the drives' encoders will read.
  void to_encoders(JointCommand& command) const noexcept;
  [[nodiscard]] std::int64_t newest_imu_ns() const noexcept { return imu_.stamp_ns; }  // accepted; 0: none yet
  // The state at a stamp of the last half second. False, and out untouched, outside, before initialisation, and where a
  // sensor was silent for longer than max_step_s.
  [[nodiscard]] bool try_state_at(std::int64_t stamp_ns, StateEstimate& out) const noexcept {
    return ring_.try_at(stamp_ns, out);
  }
  // Of that state; stamped with it.
  [[nodiscard]] const EstimateQuality& quality() const noexcept { return quality_; }
  [[nodiscard]] const LioInnovations& lio_innovations() const noexcept { return odometry_.fusion().innovations(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const Vec3& gyro_bias_radps() const noexcept { return odometry_.attitude().gyro_bias_radps(); }

 private:
  void take_joints(const std::array<bool, kFootCount>& planned_stance) noexcept;
  void calibrate() noexcept;
  void publish(std::int64_t now_ns) noexcept;

  Params params_;
  const RobotModel* robot_ = nullptr;
  Counters counters_;
  StandstillCalibration standstill_;
  ContactEstimator contacts_;
  EncoderOffsets encoders_;
  ImuNoise imu_noise_;
  ForceInference forces_;
  ProprioceptiveOdometry odometry_;
  StateHistory ring_;
  StateEstimate state_;
  EstimateQuality quality_;
  ImuSample imu_;               // last accepted; rates: the mean of those of its tick
  JointFeedback joints_;        // last accepted
  double joints_dt_s_ = 0.0;    // between it and the one before
  std::uint32_t new_imus_ = 0;  // accepted since the last tick
  bool new_joints_ = false;
  bool has_imu_ = false;
  bool has_joints_ = false;
  bool has_state_ = false;
  ProprioceptiveOdometry::Legs legs_;
  ProprioceptiveOdometry::Ground ground_;
  std::array<bool, kFootCount> stood_{};
  Transform initial_odom_T_base_;  // stood still there until initialised_ns_
  std::int64_t initialised_ns_ = 0;
};

}  // namespace polygmap
