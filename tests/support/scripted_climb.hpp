// SPDX-License-Identifier: Apache-2.0
// A climb by script: truth and telemetry with known errors, so that every figure of the report has a known answer.
#pragma once

#include <cmath>
#include <string>

#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/host/climb/climb_report.hpp"

namespace polygmap::sim {

inline constexpr std::int64_t kTick_ns = 2 * kNsPerMs;

// Steps of 0.13 x 0.28 m without jitter, landing 1 m, 1.2 m wide.
[[nodiscard]] inline StairWorld plain_stairs(int steps, double nosing_m = 0.0) {
  StairWorld world;
  for (int k = 0; k < steps; ++k) {
    const double riser_x_m = 0.28 * k;
    world.steps.push_back(
        {riser_x_m, riser_x_m - nosing_m, k + 1 == steps ? riser_x_m + 1.0 : riser_x_m + 0.28, 0.13 * (k + 1)});
  }
  return world;
}

// Errors that the script commits, each in the frame its figure is about.
struct StepErrors {
  Vec3 execution_m = Vec3::Zero();  // added to odom_T_executed
  double along_m = 0.0;             // added to the latched distance from the nosing
  double across_m = 0.0;            // added to the latched lateral place
  Vec3 tracking_m = Vec3::Zero();   // desired minus true while swinging
  std::int64_t map_age_ns = 40 * kNsPerMs;
  std::int64_t last_seen_before_latch_ns = 40 * kNsPerMs;
};

class ScriptedClimb {
 public:
  explicit ScriptedClimb(const StairWorld& world) : report(world), world_(world) {
    truth.true_T_base = {Mat3::Identity(), Vec3(-0.3, 0.0, 0.79)};
    truth.true_T_sole[0] = {Mat3::Identity(), Vec3(-0.3, 0.1, 0.0)};
    truth.true_T_sole[1] = {Mat3::Identity(), Vec3(-0.3, -0.1, 0.0)};
    state.world_T_odom = {rotation_z(0.4), Vec3(3.0, -2.0, 0.7)};
    state.initialised = true;
  }

  // The module's odometry is exact except for drift_m (in the true world).
  void tick() {
    now_ns += kTick_ns;
    truth.stamp_ns = now_ns;
    state.stamp_ns = now_ns;
    state.odom_T_base = odom_T_true * truth.true_T_base;
    state.odom_T_base.p_m += odom_T_true.R * drift_m;
    for (std::size_t foot = 0; foot < kFootCount; ++foot) {
      state.odom_T_sole[foot] = odom_T_true * truth.true_T_sole[foot];
      gait.odom_T_sole_desired[foot] = state.odom_T_sole[foot];
    }
    if (gait.phase == GaitPhase::kSwing) {
      gait.odom_T_sole_desired[index_of(gait.step.foot)].p_m += odom_T_true.R * tracking_m_;
    }
    report.observe(truth, {now_ns, state, quality, surfaces, map, gait, module_state, arming_waits_for, drives});
  }
  void wait(std::int64_t duration_ns) {
    for (std::int64_t t = 0; t < duration_ns; t += kTick_ns) tick();
  }

  [[nodiscard]] Transform world_T_true() const { return state.world_T_odom * odom_T_true; }

  // Latches a step to true_T_target, swings the true foot there in 0.4 s over `apex_m` and stands it on `step`.
  void swing(Foot foot, const Transform& true_T_target, int step, const StepErrors& errors = {}) {
    const std::size_t f = index_of(foot);
    const Transform from = truth.true_T_sole[f];
    LatchedStep& latched = gait.step;
    const std::uint32_t sequence = latched.sequence + 1;
    latched = LatchedStep{};
    latched.sequence = sequence;
    latched.foot = foot;
    latched.onto_tread = latched.height_mapped = step >= 0;
    latched.latch_stamp_ns = now_ns + kTick_ns;
    latched.map_stamp_ns = latched.latch_stamp_ns - errors.map_age_ns;
    Transform planned = true_T_target;
    planned.p_m.x() += errors.along_m;
    planned.p_m.y() += errors.across_m;
    latched.target.position_m = odom_T_true * planned.p_m;
    latched.target.yaw_rad = yaw_of(odom_T_true.R * planned.R);
    latched.target.polygon_id = static_cast<std::uint32_t>(step + 1);
    latched.target.last_seen_ns = latched.latch_stamp_ns - errors.last_seen_before_latch_ns;
    if (step >= 0) {
      latched.target.nosing_distance_m = planned.p_m.x() - world_.steps[static_cast<std::size_t>(step)].nosing_x_m;
    }
    latched.odom_T_target = odom_T_true * planned;
    tracking_m_ = errors.tracking_m;

    gait.phase = GaitPhase::kSwing;
    truth.in_contact[f] = false;
    constexpr int kTicks = 200;
    const double top_m = std::max(from.p_m.z(), true_T_target.p_m.z()) + apex_m;
    for (int i = 1; i < kTicks; ++i) {  // up, over, down
      const double s = static_cast<double>(i) / kTicks;
      const double up = std::min(1.0, 4.0 * s), over = std::clamp(2.0 * s - 0.5, 0.0, 1.0),
                   down = std::clamp(4.0 * s - 3.0, 0.0, 1.0);
      Transform& sole = truth.true_T_sole[f];
      sole.p_m = from.p_m + over * (true_T_target.p_m - from.p_m);
      sole.p_m.z() = from.p_m.z() + up * (top_m - from.p_m.z()) - down * (top_m - true_T_target.p_m.z());
      sole.R = over > 0.5 ? true_T_target.R : from.R;
      truth.true_T_base.p_m = 0.5 * (truth.true_T_sole[0].p_m + truth.true_T_sole[1].p_m) + Vec3(0, 0, 0.79);
      tick();
    }
    truth.true_T_sole[f] = true_T_target;
    truth.in_contact[f] = true;
    truth.step_index[f] = step;
    latched.touch_down_stamp_ns = now_ns + kTick_ns;
    latched.odom_T_executed = latched.odom_T_target;
    latched.odom_T_executed.p_m += errors.execution_m;
    gait.phase = GaitPhase::kDoubleSupport;
    tick();
  }
  // A sole on step k, so many metres behind its nosing.
  [[nodiscard]] Transform on_step(int k, Foot foot, double behind_m = 0.09) const {
    const Step& s = world_.steps[static_cast<std::size_t>(k)];
    return {Mat3::Identity(), Vec3(s.nosing_x_m + behind_m, side_sign(foot) * 0.1, s.height_m)};
  }
  // Both feet onto every step, then 0.2 s on top.
  void climb_all(const StepErrors& errors = {}, double behind_m = 0.09) {
    wait(200 * kNsPerMs);
    for (int k = 0; k < static_cast<int>(world_.steps.size()); ++k) {
      swing(Foot::kLeft, on_step(k, Foot::kLeft, behind_m), k, errors);
      wait(100 * kNsPerMs);
      swing(Foot::kRight, on_step(k, Foot::kRight, behind_m), k, errors);
      wait(100 * kNsPerMs);
    }
    gait.phase = GaitPhase::kFinished;
    wait(100 * kNsPerMs);
  }
  [[nodiscard]] ClimbSummary finish() const { return report.finish(RunFigures{}); }

  Transform odom_T_true{rotation_z(-0.15), Vec3(0.6, 0.2, 0.0)};
  Vec3 drift_m = Vec3::Zero();
  double apex_m = 0.1;
  std::int64_t now_ns = 0;
  Truth truth;
  StateEstimate state;
  EstimateQuality quality;
  SurfaceFrame surfaces;
  MapSnapshot map;
  GaitStatus gait;
  ModuleState module_state = ModuleState::kWalkingUp;
  DriveReport drives;
  ArmingWait arming_waits_for;
  ClimbReport report;

 private:
  StairWorld world_;
  Vec3 tracking_m_ = Vec3::Zero();
};

}  // namespace polygmap::sim
