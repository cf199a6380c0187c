// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/gait.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace polygmap {
namespace {

constexpr std::int32_t kLower_ticks = 130;  // of the torso where a foot needs a longer leg, at least:
constexpr double kLower_mps2 = 4.0;         // falling faster, it would press the ground too little to balance
constexpr std::int32_t kCrouch_ticks = 100;
constexpr double kCrouchStep_m = 0.005;
constexpr std::int32_t kOff_ticks = 5;  // a body is off its plan for longer than an estimate jumps
constexpr double kInward_m = 0.01;
constexpr double kSpare_m = 0.02;               // of its height: the base is not right over the centre of mass
constexpr std::int32_t kTickLimit = 1'000'000;  // far beyond every duration

std::int32_t lowering_ticks(double drop_m) noexcept {
  constexpr double kQuintic = 5.78;  // greatest acceleration between two rests, of distance over time squared
  const double least_s = math::sqrt(kQuintic * std::max(drop_m, 0.0) / kLower_mps2);
  return std::max(static_cast<std::int32_t>(least_s / kTick_s), kLower_ticks);
}

bool finite(const Transform& T) noexcept { return math::all_finite(T.R) && math::all_finite(T.p_m); }

}  // namespace

void Gait::reset(const Params& params) noexcept {
  params_ = params;
  planner_.reset(params.planner);
  correction_ = {};
  balance_.reset();
  dcm_error_m_.setZero();
  link_acceleration_ = {};
  base_com_bias_m_.setZero();
  status_ = {};
  activity_ = Activity::kHold;
  waiting_for_ = StopReason::kNone;
  tick_ = shifts_ = wait_ticks_ = idle_ticks_ = off_ticks_ = 0;
  put_back_ = 0;
  armed_ = started_ = unloaded_ = retried_ = settles_ = looks_ = stop_requested_ = false;
  looked_ = params.look_ticks <= 0;
  pace_.begin();
  // All else is set before it is read: by arming, by start() and by what begins a shift or a swing. A fresh object to
  // copy from would take 7 KB of stack.
}

void Gait::look_at(const StateEstimate& s) noexcept {
  usable_ = now_ns_ - s.oldest_input_ns <= params_.steer_age_ns && finite(s.odom_T_base) && finite(s.world_T_odom) &&
            finite(s.odom_T_sole[0]) && finite(s.odom_T_sole[1]) && math::all_finite(s.odom_v_base_mps) &&
            math::all_finite(s.base_w_base_radps);
}

bool Gait::lost(const StateEstimate& s) const noexcept { return now_ns_ - s.oldest_input_ns > params_.stop_age_ns; }

ClimbPlanner::Situation Gait::situation(const StateEstimate& state) const noexcept {
  // Where the soles are, not where the plan has them: legs that carry more than believed give way by some millimetres.
  return {now_ns_,
          state.world_T_odom,
          {sole_pose(state.odom_T_sole[0]), sole_pose(state.odom_T_sole[1])},
          (activity_ == Activity::kShift || looks_) && decision_.goal.kind == StepKind::kLeading,
          decision_.goal.foot};
}

void Gait::carry_plan_to_odometry() noexcept {
  const Transform odom_T_plan = correction_.odom_T_plan(plan_T_base_);
  for (Transform& sole : plan_T_sole_) sole = odom_T_plan * sole;
  plan_T_base_ = odom_T_plan * plan_T_base_;
  torso_state_ = TorsoTrajectory::placed(torso_state_, plan_T_base_, (plan_T_base_ * reference_p_com_m_).head<2>());
  plan_T_landed_ = odom_T_plan * plan_T_landed_;
  posture_.carry(odom_T_plan);
  correction_.reset();
}

void Gait::start(const StateEstimate& state) noexcept {
  plan_T_base_ = state.odom_T_base;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    plan_T_sole_[index_of(leg)] = plan_T_base_ * joints_.base_T_sole_reference(leg);
  }
  torso_state_ = TorsoTrajectory::placed({}, plan_T_base_, (plan_T_base_ * reference_p_com_m_).head<2>());
  posture_.reset(joints_.reference_rad(), reference_p_com_m_);
  started_ = true;
  begin_hold();
}

// Of the posture last asked for, in the base.
void Gait::observe_reference() noexcept {
  const MassModel& masses = params_.balance.masses;
  const BodyFrames frames = body_frames(params_.geometry, joints_.reference_rad());
  // Evened out: neither the observer's steps nor those of the plan, when it is carried, may accelerate the links.
  constexpr double kEven_s = 0.1;
  const Vec2& bias_m = balance_.odom_com_bias_m();
  const Vec3 base_bias_m = plan_T_base_.R.transpose() * Vec3{bias_m.x(), bias_m.y(), 0.0};
  base_com_bias_m_ += kTick_s / kEven_s * (base_bias_m - base_com_bias_m_);
  reference_p_com_m_ = centre_of_mass_m(masses, base_p_links_m(masses, frames)) - base_com_bias_m_;
}

// The horizontal part of the torso's trajectory is the centre of mass's: the base follows from the legs' places, one
// tick old.
Transform Gait::plan_T_base_over(const TorsoTrajectory::State& state) const noexcept {
  Transform base = TorsoTrajectory::pose(state);
  base.p_m.head<2>() -= (base.R * reference_p_com_m_).head<2>();
  return base;
}

void Gait::observe_links() noexcept {
  std::array<Transform, kFootCount> plan_T_sole = plan_T_sole_;
  if (activity_ == Activity::kSwing) plan_T_sole[index_of(decision_.goal.foot)] = swing_.at(pace_.tick());
  if (settles_) plan_T_sole[index_of(status_.step.foot)] = plan_T_landed_;
  const Vec2 plan_p_com_m =
      TorsoTrajectory::horizontal(torso_state_).position_m + (plan_T_base_.R * base_com_bias_m_).head<2>();
  link_acceleration_ =
      posture_.update(params_.geometry, params_.balance.masses, plan_T_base_, plan_p_com_m, plan_T_sole);
}

void Gait::add_torques(const StateEstimate& state, const JointFeedback& feedback, JointCommand& command) noexcept {
  Balance::Reference reference;
  for (int a = 0; a < 2; ++a) {
    const Motion& axis = torso_state_[static_cast<std::size_t>(a)];
    reference.com.position_m[a] = axis.position;
    reference.com.velocity_mps[a] = axis.speed;
    reference.com.acceleration_mps2[a] = axis.acceleration;
  }
  reference.links = link_acceleration_;
  reference.plan_T_sole = plan_T_sole_;
  reference.stands = status_.stands;
  const bool seen = started_ && usable_ && math::all_finite(feedback.dq_radps);
  // Blind, it feeds forward to where the plan has itself, and as fast: at rest it would brake.
  const Vec3 plan_v_base_mps{torso_state_[0].speed, torso_state_[1].speed, torso_state_[2].speed};
  const JointVector torque_nm =
      seen ? balance_.torques_nm(params_.balance, params_.geometry, reference,
                                 {state.odom_T_base, state.odom_v_base_mps, state.base_w_base_radps, state.q_rad},
                                 feedback, kTick_s)
           : balance_.torques_nm(params_.balance, params_.geometry, reference,
                                 {plan_T_base_, plan_v_base_mps, Vec3::Zero(), joints_.reference_rad()}, {}, kTick_s);
  if (seen) dcm_error_m_ = balance_.dcm_error_m();
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const double limit_nm = joint_limits(static_cast<Foot>(n / kJointsPerLeg), n % kJointsPerLeg).torque_nm;
    const double wanted_nm = torque_nm[static_cast<Eigen::Index>(n)];
    command.joints[n].tau_ff_nm = std::isfinite(wanted_nm) ? math::clamp(wanted_nm, -limit_nm, limit_nm) : 0.0;
  }
}

// Nothing is known but the joint angles: the soles are taken for level.
void Gait::hold_upright(JointCommand& command) noexcept {
  joints_.hold(command);
  plan_T_base_ = {joints_.base_T_sole_reference(Foot::kLeft).R.transpose(), Vec3::Zero()};
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    plan_T_sole_[index_of(leg)] = plan_T_base_ * joints_.base_T_sole_reference(leg);
  }
  torso_state_ = TorsoTrajectory::placed({}, plan_T_base_, (plan_T_base_ * reference_p_com_m_).head<2>());
  add_torques({}, {}, command);
}

void Gait::move_torso(double height_m, double yaw_rad, std::int32_t ticks, std::int32_t height_ticks) noexcept {
  torso_.plan(torso_state_, height_m, yaw_rad, ticks, height_ticks);
  torso_tick_ = 0;
}

// As low as the other sole asks for, plan frame, and the standing one allows.
void Gait::lower_torso(const SolePose& sole) noexcept {
  const Foot foot = decision_.goal.foot;
  SolePair soles{sole_pose(plan_T_sole_[0]), sole_pose(plan_T_sole_[1])};
  soles[index_of(foot)] = sole;
  const TorsoPose low = torso_over(params_.geometry, params_.step.torso, other(foot), soles);
  const double height_m = std::min(low.position_m.z() - kSpare_m, torso_state_[2].position);
  const std::int32_t ticks = lowering_ticks(torso_state_[2].position - height_m);
  move_torso(height_m, low.yaw_rad, ticks, ticks);
}

// No ground: the weight rests over the stance foot, as far towards the free foot as the sole carries. The ankle roll of
// a folded leg has little range.
void Gait::wait_over_stance(const SolePose& sole) noexcept {
  lower_torso(sole);
  const Foot foot = decision_.goal.foot;
  const Vec3 inward_m = plan_T_sole_[index_of(other(foot))].R.col(1) * (side_sign(foot) * kInward_m);
  rest_over(zmp_stance_m_ + inward_m.head<2>());
}

// The centre of mass comes to rest there.
void Gait::rest_over(const Vec2& plan_p_m) noexcept {
  ZmpKnots knots;
  (void)knots.try_push_back({params_.step.com.push_ticks, plan_p_m});
  com_.plan(params_.step.com, TorsoTrajectory::horizontal(torso_state_), knots);
  com_tick_ = 0;
}

// A body off its plan needs longer legs than planned.
double Gait::crouch_m() const noexcept {
  const double off_m = dcm_error_m_.norm();
  return off_m > params_.pace.topples_m ? std::min(params_.crouch * off_m, params_.crouch_max_m) : 0.0;
}

// On two feet, as soon as a body off its plan needs it.
void Gait::crouch() noexcept {
  const double wanted_m = crouch_m();
  if (wanted_m < crouched_m_ + kCrouchStep_m) {
    off_ticks_ = 0;
    return;
  }
  if (++off_ticks_ < kOff_ticks) return;
  crouched_m_ = wanted_m;
  const std::int32_t rest_ticks = (activity_ == Activity::kShift ? shift_ticks_ : params_.settle_ticks) - tick_;
  move_torso(upright_.height_m - crouched_m_, upright_.yaw_rad, std::max(rest_ticks, kCrouch_ticks), kCrouch_ticks);
}

void Gait::settle_between_feet() noexcept {
  const SolePair soles{sole_pose(plan_T_sole_[0]), sole_pose(plan_T_sole_[1])};
  TorsoParams torso = params_.step.torso;
  if (looks_) torso.height_m = params_.look_height_m;
  const TorsoPose middle = torso_between(params_.geometry, torso, soles);
  // The base is still elsewhere: rising at once would take the ground from the leg that it is far from.
  const TorsoPose here = torso_at(params_.geometry, torso, soles, plan_T_base_.p_m.head<2>());
  crouched_m_ = crouch_m();
  upright_ = {std::min(middle.position_m.z(), here.position_m.z()), middle.yaw_rad};
  const double height_m = upright_.height_m - crouched_m_;
  const bool soon = crouched_m_ > 0.0 && height_m < torso_state_[2].position;
  const std::int32_t soon_ticks = lowering_ticks(torso_state_[2].position - height_m);
  move_torso(height_m, upright_.yaw_rad, params_.settle_ticks, soon ? soon_ticks : params_.settle_ticks);
  const Vec3 ahead_m = rotation_z(middle.yaw_rad) * Vec3{params_.step.zmp_ahead_m, 0, 0};
  rest_over((middle.position_m + ahead_m).head<2>());
  tick_ = 0;
}

// Settled, the legs reach higher than on the way there: between two levels by centimetres.
void Gait::rise_between_feet() noexcept {
  const SolePair soles{sole_pose(plan_T_sole_[0]), sole_pose(plan_T_sole_[1])};
  const double height_m = torso_between(params_.geometry, params_.step.torso, soles).position_m.z();
  if (height_m < upright_.height_m + kCrouchStep_m) return;
  upright_.height_m = height_m;
  move_torso(upright_.height_m - crouched_m_, upright_.yaw_rad, params_.settle_ticks, params_.settle_ticks);
}

void Gait::begin_hold() noexcept {
  activity_ = Activity::kHold;
  settle_between_feet();
}

void Gait::end(GaitPhase phase, StopReason reason, double measured_m) noexcept {
  if (std::exchange(looks_, false)) settle_between_feet();  // down again
  activity_ = Activity::kEnd;
  status_.phase = phase;
  status_.stop_reason = reason;
  status_.stop_measured_m = measured_m;
}

void Gait::begin_shift(const ClimbPlanner::Decision& decision, bool again) noexcept {
  if (++shifts_ > params_.max_shifts) {
    begin_hold();
    return end(GaitPhase::kStopped, StopReason::kUnsteady, 0.0);
  }
  carry_plan_to_odometry();
  decision_ = decision;
  activity_ = Activity::kShift;
  status_.phase = GaitPhase::kDoubleSupport;
  tick_ = 0;
  const SolePair soles{sole_pose(plan_T_sole_[0]), sole_pose(plan_T_sole_[1])};
  StepPlan plan = plan_step(params_.step, decision.goal, soles, kStepTries[0]);
  if (again) plan.shift_ticks = params_.reshift_ticks;
  plan_shift(params_.step, TorsoTrajectory::horizontal(torso_state_), params_.reshift_ticks, plan, com_);
  shift_ticks_ = plan.shift_ticks;
  plan_torso(params_.geometry, params_.step, soles, com_, shift_ticks_, plan);
  crouched_m_ = crouch_m();
  upright_ = {plan.lift_off.position_m.z(), plan.lift_off.yaw_rad};
  move_torso(upright_.height_m - crouched_m_, upright_.yaw_rad, shift_ticks_, shift_ticks_);
  com_tick_ = 0;
  search_.begin(params_.geometry, params_.step, decision.goal, decision.trailing, shift_ticks_, torso_state_,
                plan_T_sole_);
}

bool Gait::looks_first(const ClimbPlanner::Decision& decision) const noexcept {
  return !looked_ && decision.goal.kind == StepKind::kLeading && planner_.treads_climbed() == 0;
}

void Gait::hold(const StateEstimate& state, const FootholdSet& footholds) noexcept {
  if (stop_requested_) return end(GaitPhase::kStopped, StopReason::kNone, 0.0);
  if (lost(state)) return end(GaitPhase::kStopped, StopReason::kStateStale, 0.0);
  if (!state.initialised || !usable_) return;
  // A body that sways sideways is best off between the feet.
  const bool sways = !(std::abs(plan_T_base_.R.col(1).head<2>().dot(dcm_error_m_)) <= params_.steady_m);
  if ((retried_ || sways) && tick_ < params_.settle_ticks) return;
  // What it learns while it looks may be that it does not stand straight yet: the whole look first, and once.
  if (looks_ && tick_ < params_.look_ticks) return;
  const ClimbPlanner::Decision decision = planner_.decide(situation(state), footholds);
  const bool has_looked = std::exchange(looks_, false);
  looked_ = looked_ || has_looked;
  if (decision.has_step) {
    wait_ticks_ = 0;
    if (!looks_first(decision)) return begin_shift(decision, false);
    decision_ = decision;
    looks_ = true;
    return settle_between_feet();
  }
  if (has_looked) settle_between_feet();
  StopReason reason = decision.obstruction;
  if (reason == StopReason::kTop || reason == StopReason::kNoStaircase) {  // nothing higher is mapped
    reason = planner_.treads_climbed() > 0 ? StopReason::kTop : StopReason::kNoStaircase;
  }
  wait_ticks_ = reason == waiting_for_ ? wait_ticks_ + 1 : 1;
  waiting_for_ = reason;
  ++idle_ticks_;
  const std::int32_t patience = status_.step.sequence == 0 ? params_.start_patience_ticks : params_.patience_ticks;
  if (wait_ticks_ >= patience) {
    if (reason == StopReason::kTop) return end(GaitPhase::kFinished, StopReason::kNone, 0.0);
    return end(GaitPhase::kStopped, reason, decision.measured_m);
  }
  if (idle_ticks_ >= params_.unsteady_patience * patience) end(GaitPhase::kStopped, StopReason::kUnsteady, 0.0);
}

bool Gait::close_to_planned(const StepGoal& goal) const noexcept {
  const StepGoal& planned = decision_.goal;
  return goal.kind == planned.kind && goal.foot == planned.foot &&
         (goal.target.position_m - planned.target.position_m).norm() <= params_.absorb_m &&
         std::abs(math::wrap_angle(goal.target.yaw_rad - planned.target.yaw_rad)) <= params_.absorb_rad;
}

void Gait::shift(const StateEstimate& state, const FootholdSet& footholds) noexcept {
  if (stop_requested_ || lost(state)) return begin_hold();
  if (search_.step() == StepSearch::State::kImpossible) {
    if (decision_.goal.kind == StepKind::kPassing) {
      if (!usable_) return;
      planner_.refuse_passing();
      return begin_shift(planner_.decide(situation(state), footholds), false);
    }
    begin_hold();
    if (decision_.goal.kind == StepKind::kFloor && planner_.shorten_floor_steps()) return;
    if (!std::exchange(retried_, true)) return;
    const double rise_m = decision_.goal.kind == StepKind::kLeading ? decision_.rise_m : 0.0;
    return end(GaitPhase::kStopped, StopReason::kLegsCannot, rise_m);
  }
  if (tick_ < shift_ticks_ || search_.state() != StepSearch::State::kFound) return;
  if (!usable_) return;
  if (!(dcm_error_m_.norm() <= params_.steady_m)) {
    if (tick_ > shift_ticks_ + params_.reshift_ticks) begin_hold();
    return;
  }
  const ClimbPlanner::Decision decision = planner_.decide(situation(state), footholds);
  if (!decision.has_step) {  // over the stance foot for a moment more: one lost frame is no reason to go back
    if (tick_ > shift_ticks_ + params_.reshift_ticks) begin_hold();
    return;
  }
  if (close_to_planned(decision.goal)) return lift_off(state, footholds, decision);
  if (looks_first(decision)) return begin_hold();
  // Over the other foot the weight has its whole way to go.
  const StepGoal& planned = decision_.goal;
  begin_shift(decision,
              decision.goal.foot == planned.foot && onto_tread(decision.goal.kind) == onto_tread(planned.kind));
}

void Gait::tick(std::int64_t now_ns, const StateEstimate& state, const FootholdSet& footholds,
                const JointFeedback& feedback, JointCommand& command) noexcept {
  command = {};
  now_ns_ = now_ns;
  command.stamp_ns = now_ns;
  status_.stamp_ns = now_ns;
  // Without one good reading the drives get no stiffness: there is nothing safe to ask of them.
  if (!armed_) {
    armed_ = joints_.try_arm(params_.geometry, params_.joints, feedback.q_rad);
    if (!armed_) return;
    observe_reference();
  }
  look_at(state);
  if (!started_) {
    hold_upright(command);
    if (state.initialised && usable_) start(state);
    return;
  }

  torso_state_ = torso_.at(torso_tick_, com_.at(com_tick_));
  plan_T_base_ = plan_T_base_over(torso_state_);
  if (usable_) {
    correction_.update(state.odom_T_base, state.odom_v_base_mps, state.odom_T_base.R * state.base_w_base_radps,
                       plan_T_base_, params_.correction_time_s);
  } else {
    correction_.missed();
  }
  switch (activity_) {
    case Activity::kHold:
      hold(state, footholds);
      break;
    case Activity::kShift:
      shift(state, footholds);
      break;
    case Activity::kSwing:
      swing(state, feedback);
      break;
    case Activity::kEnd:
      break;
  }
  if (settles_) hold_landed_foot(feedback);
  if (activity_ == Activity::kSwing) {
    set_pace();
  } else {
    if (activity_ != Activity::kShift && tick_ == params_.settle_ticks) rise_between_feet();
    crouch();
  }
  tick_ = std::min(tick_ + 1, kTickLimit);
  com_tick_ = std::min(com_tick_ + 1, kTickLimit);
  torso_tick_ = std::min(torso_tick_ + 1, kTickLimit);

  observe_links();
  const Transform base_T_plan = plan_T_base_.inverse();
  const std::array<Transform, kFootCount> base_T_sole{base_T_plan * plan_T_sole_[0], base_T_plan * plan_T_sole_[1]};
  if (joints_.follow(base_T_sole, status_.stands, command)) ++status_.ik_limited_ticks;
  observe_reference();
  add_torques(state, feedback, command);
  status_.odom_p_com_desired_m = balance_.odom_p_com_planned_m();
  const Transform odom_T_plan = correction_.odom_T_plan(plan_T_base_);
  for (std::size_t i = 0; i < kFootCount; ++i) status_.odom_T_sole_desired[i] = odom_T_plan * plan_T_sole_[i];
}

}  // namespace polygmap
