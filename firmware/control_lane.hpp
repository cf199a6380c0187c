// SPDX-License-Identifier: Apache-2.0
// Sense, estimate, gait, command: in every cycle.
//
// It starts arming, or off until its operator asks for that (Supervisor). An MIT drive answers only a command, and
// where the legs are is not known before each has answered, so commands without gains and torques ask them. The gait
// commands from the first accepted feedback on in which every drive has answered the last command, none tells of an
// error and all joints are within their ranges, if the IMU speaks too and agrees with both legs about where up is
// (StanceCheck). What is silent or disagrees half a second after the start is named, and asked on. Asked to stop
// meanwhile, it arms no more.
#pragma once

#include "algorithms/core/work.hpp"
#include "firmware/lane_link.hpp"
#include "firmware/overload_guard.hpp"
#include "firmware/params.hpp"
#include "firmware/telemetry.hpp"
#include "hal/ports/imu.hpp"
#include "hal/ports/joint_bus.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "hal/ports/operator_input.hpp"

namespace polygmap {

struct ControlPorts {
  hal::Imu& imu;
  hal::JointBus& joints;
  hal::LidarOdometry& lio;
  hal::OperatorInput* operator_input;  // null: there is none
};

class ControlLane {
 public:
  ControlLane(const ControlPorts& ports, ControlPerceptionLink& link, LaneHealths& health,
              const Params& params) noexcept;

  Progress sense(std::int64_t now_ns) noexcept;
  Progress estimate(std::int64_t now_ns) noexcept;
  Progress gait(std::int64_t now_ns) noexcept;
  Progress command(std::int64_t now_ns) noexcept;
  Progress health(std::int64_t now_ns) noexcept;

  // Once a cycle, when it is over. late: those skipped before it, and one when itself was late.
  void count_cycle(std::uint64_t late) noexcept { overload_.count_cycle(params_.overload, late); }
  void request_stop() noexcept { gait_.request_stop(StopReason::kOperator); }

  [[nodiscard]] const StateEstimate& state() const noexcept { return estimator_.state(); }
  [[nodiscard]] const GaitStatus& gait_status() const noexcept { return gait_.status(); }
  // What the gait means to do, as of its last tick; for whoever asks, and no part of the cycle.
  void tell_plan(GaitPlan& plan) const noexcept { gait_.tell_plan(plan); }
  [[nodiscard]] const Estimator& estimator() const noexcept { return estimator_; }
  [[nodiscard]] const Health& all_faults() const noexcept { return all_faults_; }  // of all lanes, as of this cycle
  [[nodiscard]] const JointCommand& last_command() const noexcept { return command_; }
  [[nodiscard]] ModuleState module_state() const noexcept;
  [[nodiscard]] ArmingWait arming_waits_for() const noexcept;
  [[nodiscard]] const DriveReport& drives() const noexcept { return drives_; }
  [[nodiscard]] const Health& faults() const noexcept { return health_; }  // of this lane
  // What perception has found, as far as this frame sees it.
  [[nodiscard]] const FootholdSet& footholds() const noexcept { return link_.footholds.front(); }
  [[nodiscard]] const LaneView& view() const noexcept { return view_; }

 private:
  void look_across(std::int64_t now_ns) noexcept;
  void read_operator(std::int64_t now_ns) noexcept;
  [[nodiscard]] OperatorAnswer obey(const OperatorRequest& request, std::int64_t now_ns) noexcept;
  [[nodiscard]] OperatorAnswer answer_to_reset(std::int64_t now_ns) const noexcept;
  // Whether it balances: all drives speak and take commands, the estimate is fresh, and both feet carry.
  [[nodiscard]] OperatorAnswer answer_if_it_stands(std::int64_t now_ns) const noexcept;
  void sense_imu(std::int64_t now_ns) noexcept;
  void read_joints(std::int64_t now_ns) noexcept;
  // While it arms, in every cycle; joints: the feedback that came, or null.
  void arm(const JointFeedback* joints, std::int64_t now_ns) noexcept;
  // False: IMU and legs disagree, and start_ says so.
  [[nodiscard]] bool check_stance(const JointVector& q_rad, std::int64_t now_ns) noexcept;
  [[nodiscard]] JointSet late_drives(const JointFeedback* joints, std::int64_t now_ns) noexcept;
  void note_out_of_range(JointSet out_of_range, std::int64_t now_ns) noexcept;
  void note_silent_drives(JointSet silent, std::int64_t now_ns) noexcept;
  void note_hot_drives(std::int64_t now_ns) noexcept;
  void report_bus(std::int64_t now_ns) noexcept;
  void answer_pose_request(std::int64_t now_ns) noexcept;
  void report_overload(std::int64_t now_ns) noexcept;
  void report_lidar(std::int64_t now_ns) noexcept;
  void report_rejections(std::int64_t now_ns) noexcept;
  void report_gait(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool listens(std::int64_t now_ns) const noexcept;
  // Of a robot that falls: no stiffness, no torque, and the drives' own damping.
  void damp_joints(std::int64_t now_ns) noexcept;
  void hand_over_robot(std::int64_t now_ns) noexcept;
  void hand_over_touch_down() noexcept;

  ControlPorts ports_;
  ControlPerceptionLink& link_;
  LaneHealths& healths_;
  Health& health_;  // this lane's
  const Params& params_;

  Estimator estimator_;
  Gait gait_;
  Supervisor supervisor_;
  HandOver hand_over_;
  Health all_faults_;
  LaneView view_;
  bool pose_asked_ = false;  // a request came with this frame
  JointCommand command_;
  DriveReport drives_;
  OverloadGuard overload_;
  struct {
    bool feet_silent = false;
    bool lio_missing = false;
    bool gait_stopped = false;
    bool fallen = false;
  } raised_;  // what lasts is a fault once, when it begins
  struct Start {
    std::int64_t first_ns = -1;         // of the first cycle: time-outs of what never speaks start there
    std::int64_t answered_ns = -1;      // when a drive answered last
    JointSet silent = JointSet::all();  // drives, never heard or silent for too long since
    bool imu_settled = false;           // heard now, and for long enough
    ArmingWait disagreement;            // of IMU and legs
    bool disagreement_named = false;
  };
  Start start_;
  std::int64_t imu_came_ns_ = -1;       // the last cycle that read a sample, good or bad; the first one before that
  std::uint32_t step_handed_over_ = 0;  // sequence of the last touch-down told to the estimator
};

}  // namespace polygmap
