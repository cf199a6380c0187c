// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/gait.hpp"

#include <cmath>
#include <utility>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

bool finite(const Transform& T) noexcept { return math::all_finite(T.R) && math::all_finite(T.p_m); }
bool finite(const StateEstimate& s) noexcept {
  return finite(s.odom_T_base) && finite(s.world_T_odom) && finite(s.odom_T_sole[0]) && finite(s.odom_T_sole[1]) &&
         math::all_finite(s.odom_v_base_mps) && math::all_finite(s.base_w_base_radps);
}

// By how much the soles are turned against each other from where they were then.
double soles_turned_rad(const StateEstimate& state, const Mat3& left_R_right_then) noexcept {
  const Mat3 R = state.odom_T_sole[0].R.transpose() * state.odom_T_sole[1].R * left_R_right_then.transpose();
  return 0.5 * Vec3{R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)}.norm();
}

}  // namespace

void Gait::reset(const Params& params, const RobotModel& robot) noexcept {
  params_ = params;
  robot_ = &robot;
  planner_.reset(params.planner, robot);
  plan_.reset();
  balance_.reset();
  link_acceleration_ = {};
  dcm_error_m_.setZero();
  memory_ = {};
  memory_.toes_calibrated = params.standing.toe_calibration.ticks <= 0;
  status_ = {};
  state_.emplace<Standing>();
  armed_ = placed_ = started_ = leg_impaired_ = lost_in_swing_ = restarts_ = false;
  may_step_ = true;
  last_tick_ns_ = 0;
  stop_requested_ = StopReason::kNone;
}

bool Gait::try_arm(const JointFeedback& feedback) noexcept {
  if (!joints_.try_arm(*robot_, params_.joints, feedback.q_rad)) return false;
  plan_.observe_reference(*robot_, joints_.reference_rad(), balance_.odom_com_bias_m(), params_.bias_time_s);
  memory_.left_R_right_met =
      joints_.base_T_sole_reference(Foot::kLeft).R.transpose() * joints_.base_T_sole_reference(Foot::kRight).R;
  return true;
}

JointSet Gait::joints_away(const JointVector& q_rad) const noexcept {
  constexpr double kMostOff_rad = 0.3;  // legs that carry the robot give way by a third of it
  JointSet away;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    if (!(std::abs(q_rad[i] - joints_.reference_rad()[i]) <= kMostOff_rad)) away.insert(n);
  }
  return away;
}

bool Gait::try_restart(const JointVector& q_rad) noexcept {
  if (!joints_away(q_rad).is_empty()) return false;
  stop_requested_ = StopReason::kNone;
  leg_impaired_ = lost_in_swing_ = false;
  memory_ = {.toes_calibrated = memory_.toes_calibrated,
             .left_R_right_met = memory_.left_R_right_met,
             .soft_ground = memory_.soft_ground};
  planner_.restart();
  status_.phase = GaitPhase::kStandstill;
  status_.stop_reason = StopReason::kNone;
  status_.stop_measured_m = 0.0;
  restarts_ = started_;
  return true;
}

// Flat soles on firm ground turn against each other by what encoders, play and a compliant sole miss. Judged while
// nothing else moves: until the standstill is over.
void Gait::judge_ground(const StateEstimate& state) noexcept {
  memory_.soft_ground = soles_turned_rad(state, memory_.left_R_right_met) > params_.soft_ground_rad;
  if (memory_.soft_ground) request_stop(StopReason::kGroundSoft);
}

// What stands in odometry by the attitude before is put where the corrected one has it: the robot has not moved.
void Gait::take_turn(const StateEstimate& state) noexcept {
  const Balance::Body body{state.odom_T_base, state.odom_v_base_mps, state.base_w_base_radps, state.q_rad};
  const Vec2 odom_shift_m = balance_.turn(*robot_, body, state.odom_turned_rad);
  const Transform& plan_T_base = plan_.plan_T_base();
  plan_.place(joints_, {so3_exp(state.odom_turned_rad) * plan_T_base.R, plan_T_base.p_m});
  plan_.shift_bias(odom_shift_m);
}

// It balances as it was met: joints, and the centre of mass over the soles. Until the estimate is calibrated nothing
// else begins. Who stops here holds on until it is reset: an estimate that comes later starts nothing.
void Gait::hold_upright(const GaitInput& in, JointCommand& command) noexcept {
  joints_.hold(command);
  if (!placed_)
    plan_.place(joints_, in.usable ? in.state.odom_T_base : joints_.base_T_sole_reference(Foot::kLeft).inverse());
  placed_ = placed_ || in.usable;
  if (!in.state.odom_turned_rad.isZero(0.0)) take_turn(in.state);
  plan_.observe_reference(*robot_, joints_.reference_rad(), balance_.odom_com_bias_m(), params_.bias_time_s);
  plan_.place(joints_, plan_.plan_T_base());
  add_torques(in.state, in.feedback, in.usable || in.mute, command);
  if (status_.phase == GaitPhase::kStopped) return;
  if (in.usable) judge_ground(in.state);
  const bool asked = in.stop_requested != StopReason::kNone;
  if (asked || in.lost) {
    status_.phase = GaitPhase::kStopped;
    status_.stop_reason = asked ? in.stop_requested : StopReason::kStateStale;
    return;
  }
  started_ = in.state.initialised && in.usable;
  if (!started_) return;
  plan_.start(joints_, in.state.odom_T_base);
  GaitShared gait = shared();
  state_.emplace<Standing>().begin(in, gait);
}

void Gait::observe_links() noexcept {
  std::array<Transform, kFootCount> plan_T_sole = plan_.plan_T_sole();
  if (const auto* swing = std::get_if<SwingPhase>(&state_)) plan_T_sole[index_of(swing->foot())] = swing->sole();
  link_acceleration_ = plan_.observe_links(*robot_, plan_T_sole);
}

void Gait::add_torques(const StateEstimate& state, const JointFeedback& feedback, bool usable,
                       JointCommand& command) noexcept {
  const Balance::Reference reference{plan_.com(),    link_acceleration_, plan_.plan_T_sole(),
                                     status_.stands, status_.on_toe,     memory_.soft_ground};
  // Blind, it feeds forward to where the plan has itself, and as fast: at rest it would brake.
  const TorsoTrajectory::State& torso = plan_.torso();
  const Vec3 plan_v_base_mps{torso[0].speed, torso[1].speed, torso[2].speed};
  const bool seen = usable && math::all_finite(feedback.dq_radps);
  JointVector torque_nm =
      seen ? balance_.torques_nm(params_.balance, *robot_, reference,
                                 {state.odom_T_base, state.odom_v_base_mps, state.base_w_base_radps, state.q_rad},
                                 feedback, kTick_s)
           : balance_.torques_nm(params_.balance, *robot_, reference,
                                 {plan_.plan_T_base(), plan_v_base_mps, Vec3::Zero(), joints_.reference_rad()}, {},
                                 kTick_s);
  if (seen) {
    dcm_error_m_ = balance_.dcm_error_m();
    joints_.add_damping(status_.stands, feedback, command, torque_nm);
  }
  joints_.stiffen_blind(!seen, status_.stands, command);
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const double limit_nm = robot_->drives.limits[n].torque_nm;
    const double wanted_nm = torque_nm[static_cast<Eigen::Index>(n)];
    command.joints[n].tau_ff_nm = std::isfinite(wanted_nm) ? math::clamp(wanted_nm, -limit_nm, limit_nm) : 0.0;
  }
}

Transition Gait::tick_state(const GaitInput& in, GaitShared& gait) noexcept {
  if (auto* standing = std::get_if<Standing>(&state_)) return standing->tick(in, gait);
  if (auto* shift = std::get_if<WeightShift>(&state_)) return shift->tick(in, gait);
  if (auto* swing = std::get_if<SwingPhase>(&state_)) return swing->tick(in, gait);
  return {};
}

void Gait::enter(const GaitInput& in, GaitShared& gait, const Transition& next) noexcept {
  switch (next.to) {
    case Transition::To::kStay:
      break;
    case Transition::To::kStanding:
      state_.emplace<Standing>().begin(in, gait);
      break;
    case Transition::To::kWeightShift:
      if (++memory_.shifts <= params_.weight_shift.max_shifts) {
        state_.emplace<WeightShift>().begin(in, gait, *next.decision, next.same_foot);
      } else {
        state_.emplace<Standing>().begin(in, gait);
        end(in, gait, Transition::stop(in.footholds.unsteady));
      }
      break;
    case Transition::To::kSwing:
      state_.emplace<SwingPhase>().begin(in, gait, *next.decision, *next.tried);
      break;
    case Transition::To::kEnd:
      if (!std::holds_alternative<Standing>(state_)) state_.emplace<Standing>().begin(in, gait);
      end(in, gait, next);
      break;
  }
}

// From standing.
void Gait::end(const GaitInput& in, GaitShared& gait, const Transition& next) noexcept {
  if (auto* standing = std::get_if<Standing>(&state_)) state_.emplace<End>(standing->end(in, gait));
  status_.phase = next.phase;
  status_.stop_reason = next.reason;
  status_.stop_measured_m = next.measured_m;
}

void Gait::follow_state(const GaitInput& in, GaitShared& gait) noexcept {
  if (auto* standing = std::get_if<Standing>(&state_)) standing->follow(in, gait);
  if (auto* shift = std::get_if<WeightShift>(&state_)) shift->follow(in, gait);
  if (auto* swing = std::get_if<SwingPhase>(&state_)) swing->follow(in, gait);
  if (auto* over = std::get_if<End>(&state_)) over->follow(in, gait);
}

void Gait::advance(const GaitInput& in) noexcept {
  GaitShared gait = shared();
  if (in.usable && in.state.initialised) planner_.lay_out_destination(situation(in).soles);
  if (in.held) {
    plan_.hold(params_.held_body, status_.stands[0] && status_.stands[1], in.leg_impaired);
  } else {
    plan_.advance();
  }
  if (in.usable || in.mute) {
    plan_.correct(in.state, params_.correction_time_s);
  } else {
    plan_.correction_missed();
  }
  if (std::exchange(restarts_, false)) state_.emplace<Standing>().begin(in, gait);
  enter(in, gait, tick_state(in, gait));
  // Thrown, the body lifts a foot that was to stand. A foot that it leaves as planned needs no hold.
  const LandedFootParams& landed = params_.landed_foot;
  memory_.thrown = in.odom_dcm_error_m.norm() > (memory_.thrown ? landed.caught_m : landed.thrown_m);
  if ((memory_.thrown || memory_.aborted_swings > 0) && status_.phase == GaitPhase::kDoubleSupport && in.usable &&
      !in.held) {
    plan_.hold_lifted_foot(params_.landed_foot, in.state, in.feedback, in.now_ns);
  }
  if (status_.phase == GaitPhase::kDoubleSupport && in.usable && !in.held) {
    plan_.settle_feet_apart(params_.feet_apart, in.state, in.feedback);
  }
  plan_.hold_landed_foot(params_.landed_foot, in.feedback, in.now_ns);
  follow_state(in, gait);
  if (!std::holds_alternative<WeightShift>(state_)) {
    plan_.lower_heels(robot_->sole, params_.step.down.heel_rise.radps * kTick_s);
  }
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) status_.on_toe[index_of(foot)] = plan_.is_on_toe(foot);
  if (!in.held) plan_.count_tick();
}

void Gait::tick(std::int64_t now_ns, const StateEstimate& state, const FootholdSet& footholds,
                const JointFeedback& feedback, JointCommand& command) noexcept {
  command = {};
  command.stamp_ns = now_ns;
  status_.stamp_ns = now_ns;
  armed_ = armed_ || try_arm(feedback);
  if (!armed_) return;
  const std::int64_t age_ns = now_ns - state.oldest_input_ns;
  const bool known = state.oldest_input_ns > 0 && finite(state);
  const bool usable = known && age_ns <= params_.steer_age_ns;
  const bool mute = known && !usable && now_ns - state.heard_ns <= params_.steer_age_ns;
  const bool lost = age_ns > params_.stop_age_ns;
  leg_impaired_ = leg_impaired_ || (started_ && lost && mute);
  lost_in_swing_ = lost_in_swing_ || (lost && status_.phase == GaitPhase::kSwing);
  const GaitInput in{now_ns,
                     state,
                     footholds,
                     feedback,
                     joints_,
                     dcm_error_m_,
                     usable,
                     mute,
                     leg_impaired_,
                     mute || leg_impaired_,
                     lost || leg_impaired_ || lost_in_swing_,
                     stop_requested_,
                     may_step_,
                     now_ns - std::exchange(last_tick_ns_, now_ns)};
  if (!started_) {
    hold_upright(in, command);
    return;
  }
  advance(in);
  observe_links();
  const Transform base_T_plan = plan_.plan_T_base().inverse();
  const std::array<Transform, kFootCount>& plan_T_sole = plan_.plan_T_sole();
  std::array<Transform, kFootCount> base_T_sole{base_T_plan * plan_T_sole[0], base_T_plan * plan_T_sole[1]};
  if (in.held) joints_.fit_mute_knees(feedback, status_.stands, in.leg_impaired, base_T_sole);
  if (joints_.follow(base_T_sole, status_.stands, command)) {
    ++status_.ik_limited_ticks;
  }
  plan_.observe_reference(*robot_, joints_.reference_rad(), balance_.odom_com_bias_m(), params_.bias_time_s);
  add_torques(state, feedback, in.usable || in.mute, command);
  status_.odom_p_com_desired_m = balance_.odom_p_com_planned_m();
  const Transform odom_T_plan = plan_.odom_T_plan();
  for (std::size_t i = 0; i < kFootCount; ++i) status_.odom_T_sole_desired[i] = odom_T_plan * plan_T_sole[i];
}

}  // namespace polygmap
