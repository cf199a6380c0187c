// SPDX-License-Identifier: Apache-2.0
// The gait on the robot under physics, with every sensor's errors and the module's own estimator, and footholds read
// from the true stairs: what perception adds is left out, so that a climb takes a second or two.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>

#include "algorithms/estimation/estimator.hpp"
#include "algorithms/gait/gait.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {

[[nodiscard]] inline SimOptions without_pictures(SimOptions options) {
  options.plant_kind = PlantKind::kMujoco;
  options.camera.silent = {{0, std::numeric_limits<std::int64_t>::max()}};
  return options;
}

class PhysicalClimb {
 public:
  explicit PhysicalClimb(const SimOptions& options, const Gait::Params& gait = {}) : robot_(without_pictures(options)) {
    estimator_.reset({}, nominal_robot());
    gait_.reset(gait, nominal_robot());
  }

  // One tick; false when the gait has ended or the robot fell.
  bool tick() {
    robot_.advance();
    const std::int64_t now_ns = robot_.now_ns();
    ImuSample imu;
    while (robot_.try_read(imu)) estimator_.add_imu(imu, now_ns);
    JointFeedback joints;
    if (robot_.try_read(joints) && !joints_silent) {
      if (tamper) tamper(joints);
      estimator_.add_joints(joints, now_ns);
    }
    LioSample lio;
    while (robot_.try_read(lio)) estimator_.add_lio(lio, now_ns);
    estimator_.tick(gait_.status().stands);
    constexpr int kFrame_ticks = 16;
    if (ticks_++ % kFrame_ticks == 0) {
      footholds_ = search();
      if (tamper_footholds) tamper_footholds(footholds_);
    }
    gait_.tick(now_ns, estimator_.state(), footholds_, estimator_.leg_sensing().joints(), command_);
    if (tamper_command) tamper_command(command_, footholds_, estimator_.leg_sensing().joints());
    estimator_.leg_sensing().to_encoders(command_);
    (void)robot_.try_write(command_);
    const GaitPhase phase = gait_.status().phase;
    return phase != GaitPhase::kFinished && phase != GaitPhase::kStopped && !robot_.truth().fell;
  }
  void run(double limit_s) {
    const double end_s = time_s() + limit_s;
    while (time_s() < end_s && tick()) {
    }
  }

  [[nodiscard]] const Truth& truth() const { return robot_.truth(); }
  [[nodiscard]] const GaitStatus& status() const { return gait_.status(); }
  [[nodiscard]] const StateEstimate& state() const { return estimator_.state(); }
  [[nodiscard]] const JointCommand& command() const { return command_; }
  [[nodiscard]] SimRobot& robot() { return robot_; }
  [[nodiscard]] MujocoPlant& plant() { return dynamic_cast<MujocoPlant&>(robot_.plant()); }
  [[nodiscard]] Gait& gait() { return gait_; }
  [[nodiscard]] double time_s() const { return seconds(robot_.now_ns()); }

  // May change what the module sees, after it was made.
  std::function<void(JointFeedback&)> tamper;
  std::function<void(FootholdSet&)> tamper_footholds;
  // The command before it is sent, with what else the gait was told.
  std::function<void(JointCommand&, const FootholdSet&, const JointFeedback&)> tamper_command;
  bool joints_silent = false;

 private:
  // What a map without errors would give at this moment.
  [[nodiscard]] FootholdSet search() const {
    const Truth& truth = robot_.truth();
    const StateEstimate& state = estimator_.state();
    // Seen from the base, as a camera sees it: legs and camera share an error of the attitude.
    const Transform world_T_true = state.world_T_base() * truth.true_T_base.inverse();
    FootholdSet set;
    set.map_stamp_ns = state.stamp_ns - 40 * kNsPerMs;
    set.obstruction = StopReason::kNone;
    double stance_m = -1e9;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      if (gait_.status().stands[f]) stance_m = std::max(stance_m, truth.true_T_sole[f].p_m.z());
    }
    const auto& steps = robot_.stairs().steps;
    std::size_t next = 0;
    while (next < steps.size() && steps[next].height_m < stance_m + 0.04) ++next;
    if (next == steps.size()) {
      set.obstruction = StopReason::kTop;
      return set;
    }
    const auto place = [&](std::size_t index, std::array<Foothold, kFootCount>& feet) {
      const Step& on = steps[index];
      const double inset_m = std::min(0.5 * (on.back_x_m - on.nosing_x_m - 0.252), 0.014);
      for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
        Foothold& hold = feet[index_of(foot)];
        hold.position_m = world_T_true * Vec3{on.nosing_x_m + inset_m - kContactRectangle.heel_x_m,
                                              side_sign(foot) * kStanceHalfWidth_m, on.height_m};
        hold.yaw_rad = yaw_of(world_T_true.R);
        hold.polygon_id = static_cast<std::uint32_t>(index) + 10;
        hold.last_seen_ns = set.map_stamp_ns;
      }
    };
    const Step& step = steps[next];
    set.has_p_star = true;
    place(next, set.p_star_feet);
    set.p_star = set.p_star_feet[0];
    set.has_p_star_star = next + 1 < steps.size();
    if (set.has_p_star_star) place(next + 1, set.p_star_star_feet);
    set.tread.nosing_a_m = world_T_true * Vec3{step.nosing_x_m, 0.6, step.height_m};
    set.tread.nosing_b_m = world_T_true * Vec3{step.nosing_x_m, -0.6, step.height_m};
    set.measured_rise_m = step.height_m - stance_m;
    return set;
  }

  SimRobot robot_;
  Estimator estimator_;
  Gait gait_;
  JointCommand command_;
  FootholdSet footholds_;
  int ticks_ = 0;
};

[[nodiscard]] inline SimOptions few_steps(std::uint64_t seed) {
  SimOptions options;
  options.seed = seed;
  options.stairs.steps = 2;
  return options;
}

// Runs on for for_s after the gait ended: upright, on both feet, its centre of mass at rest where planned.
[[nodiscard]] inline bool stands_for(PhysicalClimb& climb, double for_s) {
  const double end_s = climb.time_s() + for_s;
  while (climb.time_s() < end_s && !climb.truth().fell) (void)climb.tick();
  return !climb.truth().fell && climb.truth().in_contact[0] && climb.truth().in_contact[1] &&
         climb.gait().balance().com_error_m().norm() < 0.02;
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
