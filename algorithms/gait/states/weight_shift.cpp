// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/weight_shift.hpp"

#include <algorithm>

namespace polygmap {

void WeightShift::begin(const GaitInput& in, GaitShared& gait, const ClimbPlanner::Decision& decision,
                        bool same_foot) noexcept {
  const StepParams& params = gait.params.step;
  const std::int32_t reshift_ticks = gait.params.weight_shift.reshift_ticks;
  BodyPlan& body = gait.plan;
  body.carry_to_odometry();
  decision_ = decision;
  gait.status.phase = GaitPhase::kDoubleSupport;
  const std::array<Transform, kFootCount> flat{body.flat_sole(gait.robot.sole, Foot::kLeft),
                                               body.flat_sole(gait.robot.sole, Foot::kRight)};
  const SolePair soles{sole_pose(flat[0]), sole_pose(flat[1])};
  StepPlan plan = plan_step(params, decision.goal, soles, tries_for(params, decision.goal, soles)[0]);
  if (same_foot) plan.shift_ticks = reshift_ticks;
  ComPlan& com = body.renewed_com();
  plan_shift(params, body.com(), reshift_ticks, plan, com);
  shift_ticks_ = plan.shift_ticks;
  swing_ticks_ = plan.swing_ticks;
  plan_torso(gait.robot.legs, params, soles, com, shift_ticks_, plan);
  crouch_.begin(in, gait, plan.lift_off);
  body.move_torso(crouch_.torso(), shift_ticks_, shift_ticks_);
  search_.begin(gait.robot, params, decision.goal, decision.trailing, shift_ticks_, body.torso(), flat);
}

Transition WeightShift::tick(const GaitInput& in, GaitShared& gait) noexcept {
  const WeightShiftParams& params = gait.params.weight_shift;
  // Once its heel is up a rear foot follows the other one down, though the operator asks to stop or to pause: on the
  // way back its ankle would bend farther than it can.
  const bool must_end =
      in.lost || (in.stop_requested != StopReason::kNone && in.stop_requested != StopReason::kOperator);
  const bool is_asked = in.stop_requested == StopReason::kOperator || !in.may_step;
  const bool ends = must_end || (is_asked && !gait.plan.is_on_toe(decision_.goal.foot));
  if (ends || in.since_last_ns > params.max_gap_ns) return Transition::stand();
  if (search_.step(gait.robot, gait.params.step) == StepSearch::State::kImpossible) return legs_cannot(in, gait);
  if (tick_ < shift_ticks_ || search_.state() != StepSearch::State::kFound || !in.usable) return {};
  if (!(in.odom_dcm_error_m.norm() <= gait.params.steady_m)) return wait(params);
  const StepGoal& planned = decision_.goal;
  ClimbPlanner::Decision decision =
      gait.planner.decide(situation(in, planned.kind == StepKind::kLeading, planned.foot), in.footholds);
  if (!decision.has_step) return wait(params);
  if (decision.trails_to_lip != decision_.trails_to_lip) {  // the step after it is the one that the legs can do
    decision.trailing = decision_.trailing;
    decision.trails_to_lip = decision_.trails_to_lip;
  }
  if (close_to_planned(params, decision.goal)) return Transition::swing(decision, search_.plan().tried);
  // Once its heel is up the foot keeps its goal: a new shift of the weight is planned from a flat foot.
  if (gait.plan.is_on_toe(planned.foot)) return Transition::swing(decision_, search_.plan().tried);
  if (needs_toe_calibration(gait, decision.goal)) return Transition::stand();
  // Over the other foot the weight has its whole way to go.
  const bool same_foot =
      decision.goal.foot == planned.foot && onto_tread(decision.goal.kind) == onto_tread(planned.kind);
  return Transition::shift(decision, same_foot);
}

Transition WeightShift::legs_cannot(const GaitInput& in, GaitShared& gait) const noexcept {
  const StepKind kind = decision_.goal.kind;
  if (kind == StepKind::kPassing) {
    if (!in.usable) return {};
    gait.planner.refuse_passing();
    return Transition::shift(gait.planner.decide(situation(in), in.footholds), false);
  }
  const bool cannot_trail = kind == StepKind::kTrailing || search_.leading_found();
  if (decision_.trails_to_lip && cannot_trail && gait.planner.trail_beside()) return Transition::stand();
  if (kind == StepKind::kFloor && gait.planner.shorten_floor_steps()) return Transition::stand();
  if (kind == StepKind::kLeading && gait.planner.come_nearer(decision_)) return Transition::stand();
  gait.memory.rests_first = true;
  if (++gait.memory.refusals < gait.params.weight_shift.max_refusals) return Transition::stand();
  if (kind == StepKind::kClosing && gait.planner.leave_slid_foot()) {
    gait.memory.refusals = 0;
    return Transition::stand();
  }
  if (kind == StepKind::kLeading && in.usable && gait.planner.close_up(situation(in))) return Transition::stand();
  return Transition::stop(StopReason::kLegsCannot, kind == StepKind::kLeading ? decision_.rise_m : 0.0);
}

void WeightShift::follow(const GaitInput& in, GaitShared& gait) noexcept {
  if (in.held) return;
  crouch_.update(in, gait, shift_ticks_ - tick_);
  const Foot foot = decision_.goal.foot;
  if (search_.state() == StepSearch::State::kFound && search_.plan().heel_up_rad > 0.0) {
    const double heel_up_rad = search_.plan().heel_up_rad_at(tick_);
    gait.plan.raise_heel(gait.robot.sole, foot, std::max(heel_up_rad, gait.plan.heel_up_rad(foot)));
  }
  tick_ = next_tick(tick_);
}

StepAhead WeightShift::ahead() const noexcept {
  StepAhead step;
  step.goal = &decision_.goal;
  if (leads(decision_.goal.kind)) step.after = &decision_.trailing;
  step.lift_off_ticks = std::max(shift_ticks_ - tick_ + 1, 1);
  step.swing_ticks = search_.state() == StepSearch::State::kFound ? search_.plan().swing_ticks : swing_ticks_;
  return step;
}

bool WeightShift::close_to_planned(const WeightShiftParams& params, const StepGoal& goal) const noexcept {
  const StepGoal& planned = decision_.goal;
  return goal.kind == planned.kind && goal.foot == planned.foot &&
         (goal.target.position_m - planned.target.position_m).norm() <= params.absorb_m &&
         std::abs(math::wrap_angle(goal.target.yaw_rad - planned.target.yaw_rad)) <= params.absorb_rad;
}

}  // namespace polygmap
