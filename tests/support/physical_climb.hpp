// SPDX-License-Identifier: Apache-2.0
// The whole module on the robot under physics, with every sensor's errors and perception in the loop. A test tampers at
// the ports, where a robot's sensors, drives and stairs would go wrong.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "firmware/pipeline.hpp"
#include "firmware/schedule.hpp"
#include "sim_stub/sim_robot.hpp"
#include "sim_stub/world/clearance.hpp"
#include "tests/support/fakes/fake_operator_input.hpp"

namespace polygmap::sim {

class TamperedJoints final : public hal::JointBus {
 public:
  explicit TamperedJoints(hal::JointBus& bus) noexcept : bus_(bus) {}
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (silent || !bus_.try_read(feedback)) return false;
    if (tamper) tamper(feedback);
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    return refuses ? JointSet{} : bus_.try_write(instead ? *instead : command);
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override {
    hal::JointBusStatus status = bus_.status();
    if (!in_error.is_empty()) {
      status.drive_errors = in_error;
      ++status.drive_error_replies;
    }
    if (hottest_degc) status.drive_degc[4] = *hottest_degc;
    return status;
  }

  std::function<void(JointFeedback&)> tamper;
  const JointCommand* instead = nullptr;  // another module's command goes to the drives
  bool silent = false;
  bool refuses = false;                      // every command
  JointSet in_error;                         // drives that tell of one
  std::optional<std::int16_t> hottest_degc;  // a drive tells of

 private:
  hal::JointBus& bus_;
};

class TamperedImu final : public hal::Imu {
 public:
  explicit TamperedImu(hal::Imu& imu) noexcept : imu_(imu) {}
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override { return !silent && imu_.try_read(sample); }

  bool silent = false;

 private:
  hal::Imu& imu_;
};

class TamperedCamera final : public hal::DepthCamera {
 public:
  explicit TamperedCamera(hal::DepthCamera& camera)
      : camera_(camera), no_depth_(static_cast<std::size_t>(kDepthWidth_px) * kDepthHeight_px, 0) {}
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return camera_.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (silent || !camera_.try_acquire(frame)) return false;
    if (blank) frame.depth = no_depth_.data();
    return true;
  }
  void release() noexcept override { camera_.release(); }

  bool blank = false;   // frames arrive without one valid pixel
  bool silent = false;  // no frame arrives

 private:
  hal::DepthCamera& camera_;
  std::vector<std::uint16_t> no_depth_;
};

class TamperedLidar final : public hal::LidarOdometry {
 public:
  explicit TamperedLidar(hal::LidarOdometry& lidar) noexcept : lidar_(lidar) {}
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override { return !silent && lidar_.try_read(sample); }

  bool silent = false;

 private:
  hal::LidarOdometry& lidar_;
};

class PhysicalClimb {
 public:
  explicit PhysicalClimb(const SimOptions& options, const Params& params = {})
      : robot_(under_physics(options)),
        pipeline_(std::make_unique<Pipeline>(Ports{camera, imu, joints, lidar, &operator_input}, params)),
        tasks_{*pipeline_, robot_.clock(), row_share},
        executive_(tasks_, robot_, pipeline_->lane_health(0)) {
    executive_.start(robot_.now_ns() + kCycle_ns);
  }

  // The robot goes on, nobody wakes the module: what it commanded last holds.
  void stall(int cycles) {
    for (int i = 0; i < cycles; ++i) robot_.advance();
  }
  // One cycle; false when the gait has ended or the robot fell.
  bool tick() {
    robot_.advance();
    executive_.tick(robot_.now_ns());
    for (std::size_t f = 0; f < kFootCount; ++f) {
      const int step = truth().step_index[f];
      if (!status().stands[f] || !truth().in_contact[f] || step < 0) continue;  // or it brushed the step
      sole_margin_min_m_ =
          std::min(sole_margin_min_m_, sim::sole_margin_m(truth().true_T_sole[f], robot_.stairs(), step));
    }
    const GaitPhase phase = status().phase;
    return phase != GaitPhase::kFinished && phase != GaitPhase::kStopped && !truth().fell;
  }
  void run(double limit_s) {
    const double end_s = time_s() + limit_s;
    while (time_s() < end_s && tick()) {
    }
  }
  // Goes on after the gait has ended, until the robot falls.
  void run_on(double for_s) {
    const double end_s = time_s() + for_s;
    while (time_s() < end_s && !truth().fell) (void)tick();
  }
  void hold_again() { robot_.hold_again(); }
  void push(const Push& push) {
    Vec3 force_n = Vec3::Zero();
    force_n[push.axis] = push.impulse_ns / Push::kDuration_s;
    robot_.plant().push(force_n);
    run_on(Push::kDuration_s);
    robot_.plant().push(Vec3::Zero());
  }

  [[nodiscard]] const Truth& truth() const { return robot_.truth(); }
  [[nodiscard]] const StairWorld& stairs() const { return robot_.stairs(); }
  [[nodiscard]] const GaitStatus& status() const { return pipeline_->control().gait_status(); }
  [[nodiscard]] const Health& health() const { return pipeline_->health(); }
  [[nodiscard]] const JointCommand& command() const { return pipeline_->control().last_command(); }
  [[nodiscard]] const LegSensing& leg_sensing() const { return pipeline_->control().estimator().leg_sensing(); }
  [[nodiscard]] ModuleState state() const { return pipeline_->control().module_state(); }
  [[nodiscard]] double time_s() const { return seconds(robot_.now_ns()); }
  // Of every sole that stood on a step, at any time, to its tread's edge; negative over it.
  [[nodiscard]] double sole_margin_min_m() const { return sole_margin_min_m_; }
  void request_stop() { pipeline_->control().request_stop(); }
  // Planned against true centre of mass, seen from the left sole, which stands.
  [[nodiscard]] double com_error_m() const {
    const Transform& odom_T_sole = status().odom_T_sole_desired[0];
    const Vec2& odom_p_com_m = status().odom_p_com_desired_m;
    const Vec3 planned_m = odom_T_sole.inverse() * Vec3{odom_p_com_m.x(), odom_p_com_m.y(), odom_T_sole.p_m.z()};
    const Vec3 true_m = truth().true_T_sole[0].inverse() * truth().true_p_com_m;
    return (planned_m - true_m).head<2>().norm();
  }

 private:
  static SimOptions under_physics(SimOptions options) {
    options.plant_kind = PlantKind::kMujoco;
    return options;
  }

  SimRobot robot_;

 public:
  TamperedJoints joints{robot_};
  TamperedCamera camera{robot_};
  TamperedLidar lidar{robot_};
  TamperedImu imu{robot_};
  fakes::FakeOperatorInput operator_input;
  std::function<double(std::size_t row)> row_share;  // a row takes this share of its time; empty: none

 private:
  // The module's rows, which take time.
  struct TimedRows {
    Pipeline& pipeline;
    VirtualClock& clock;
    const std::function<double(std::size_t)>& share;  // of the row's budget, or of what its units cost

    Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
      const std::int32_t units = budget.left();
      const Progress progress = pipeline.run_row(row, cycle_ns, budget);
      const ScheduleRow& r = kTasks[row].row;
      const double full_ns = r.resumable() ? 1.0 * (units - budget.left()) * r.unit_cost_ns : 1e3 * r.budget_us;
      if (share) clock.inject_count(static_cast<std::uint64_t>(share(row) * full_ns));
      return progress;
    }
    void cycle_done(std::size_t lane, const CycleReport& report) noexcept { pipeline.cycle_done(lane, report); }
  };
  std::unique_ptr<Pipeline> pipeline_;
  TimedRows tasks_;
  OneLaneExecutive<TimedRows> executive_;
  double sole_margin_min_m_ = std::numeric_limits<double>::infinity();
};

[[nodiscard]] inline SimOptions stairs_of(int steps, std::uint64_t seed) {
  SimOptions options;
  options.seed = seed;
  options.stairs.steps = steps;
  options.noise = seed % 2 == 0 ? NoiseKind::kCorrelated : NoiseKind::kWhite;
  return options;
}

// Runs on for for_s after the gait ended: upright, on both feet, its centre of mass at rest where planned.
[[nodiscard]] inline bool stands_for(PhysicalClimb& climb, double for_s) {
  climb.run_on(for_s);
  return !climb.truth().fell && climb.truth().in_contact[0] && climb.truth().in_contact[1] &&
         climb.com_error_m() < 0.02;
}
// Until the nth swing onto a tread; false when that never came.
[[nodiscard]] inline bool run_to_swing_onto(PhysicalClimb& climb, std::uint32_t nth, double limit_s = 40.0) {
  std::uint32_t onto = 0, sequence = 0;
  while (climb.time_s() < limit_s && climb.tick()) {
    const LatchedStep& step = climb.status().step;
    if (step.sequence != sequence && step.onto_tread) ++onto;
    sequence = step.sequence;
    if (onto == nth) return true;
  }
  return false;
}

}  // namespace polygmap::sim
