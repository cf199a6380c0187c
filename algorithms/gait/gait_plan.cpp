// SPDX-License-Identifier: Apache-2.0
// What the gait tells of its plan.
#include "algorithms/core/time.hpp"
#include "algorithms/gait/gait.hpp"

namespace polygmap {
namespace {

constexpr std::int64_t kTick_ns = 2 * kNsPerMs;
static_assert(kTick_s == 0.002);

PlannedStep step_to(const StepGoal& goal, StepCertainty certainty) noexcept {
  PlannedStep step;
  step.certainty = certainty;
  step.foot = goal.foot;
  step.onto_tread = onto_tread(goal.kind);
  step.target_m = goal.target.position_m;
  step.yaw_rad = goal.target.yaw_rad;
  step.up = goal.target.up;
  step.polygon_id = goal.foothold.polygon_id;
  return step;
}

}  // namespace

void Gait::tell_plan(GaitPlan& plan) const noexcept {
  plan.stamp_ns = status_.stamp_ns;
  plan.planned = started_;
  plan.held = plan_.is_held();
  plan.steps.clear();
  plan.bodies.clear();
  plan.has_landing = false;
  if (!started_) return;
  const Transform odom_T_plan = plan_.odom_T_plan();
  for (std::size_t i = 0; i < kFootCount; ++i) plan.odom_T_sole[i] = odom_T_plan * plan_.plan_T_sole()[i];
  const auto at = [&](std::int32_t ticks) { return plan.stamp_ns + ticks * kTick_ns; };
  const auto body_at = [&](std::int32_t ticks) {
    PlannedBody body = plan_.ahead(ticks);
    body.stamp_ns = at(ticks);
    return body;
  };
  for (std::int32_t i = 0; i < (plan.held ? 1 : static_cast<std::int32_t>(GaitPlan::kSamples)); ++i) {
    (void)plan.bodies.try_push_back(body_at(i * GaitPlan::kSample_ticks));
  }

  const auto* shift = std::get_if<WeightShift>(&state_);
  const auto* swing = std::get_if<SwingPhase>(&state_);
  if (shift == nullptr && swing == nullptr) return;
  const StepAhead ahead = shift != nullptr ? shift->ahead() : swing->ahead(planner_);
  PlannedStep step = step_to(*ahead.goal, shift != nullptr ? StepCertainty::kPlanned : StepCertainty::kLatched);
  const std::int32_t landing = ahead.lift_off_ticks + ahead.swing_ticks;
  if (swing != nullptr) step.lift_off_ns = status_.step.latch_stamp_ns;
  if (ahead.returns) {
    const SolePose back = sole_pose(ahead.back_to);
    step.returns = true;
    step.target_m = back.position_m;
    step.yaw_rad = back.yaw_rad;
    step.up = ahead.back_to.R.col(2);
    step.polygon_id = 0;
  } else if (!plan.held) {
    if (shift != nullptr) step.lift_off_ns = at(ahead.lift_off_ticks);
    step.touch_down_ns = at(landing);
    plan.has_landing = true;
    plan.landing = body_at(landing);
  }
  (void)plan.steps.try_push_back(step);
  if (ahead.after == nullptr) return;
  PlannedStep after = step_to(*ahead.after, StepCertainty::kExpected);
  if (!plan.held) {
    const StepDurations& usual = params_.step.durations;
    after.lift_off_ns = step.touch_down_ns + kTick_ns * (1 + usual.stair_shift_ticks);
    after.touch_down_ns = after.lift_off_ns + kTick_ns * usual.stair_swing_ticks;
  }
  (void)plan.steps.try_push_back(after);
}

}  // namespace polygmap
