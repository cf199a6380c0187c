// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/swing_phase.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace polygmap {

void SwingPhase::begin(const GaitInput& in, GaitShared& gait, const ClimbPlanner::Decision& decision,
                       const StepTry& tried) noexcept {
  const StepParams& params = gait.params.step;
  BodyPlan& body = gait.plan;
  // The leg that carries now puts the base elsewhere than the two of them did: take it from there, and level it.
  body.carry_to_odometry();
  goal_ = decision.goal;
  tried_ = tried;
  const SolePair soles = body.soles();
  StepPlan plan = plan_step(params, goal_, soles, tried_);
  ComPlan& com = body.renewed_com();
  com.plan(params.com, body.com(), zmp_of_swing(plan));
  plan_torso(gait.robot.legs, params, soles, com, 0, plan);
  const Transform& start = body.plan_T_sole(goal_.foot);
  if (in.usable) {
    odom_off_path_m_ = in.state.odom_T_sole[index_of(goal_.foot)].p_m - start.p_m;
    odom_off_path_m_.z() = 0.0;
  }
  // A riser may be at its heel: it goes on from where it stands, which is ahead of where the plan has it. Feet stood up
  // to 16 mm ahead in climbs of the simulation. The search proves a leading step down without this.
  constexpr double kMostAhead_m = 0.02;
  const double ahead_m = math::clamp(start.R.col(0).dot(odom_off_path_m_), 0.0, kMostAhead_m);
  const bool leads_down = goes_down(goal_, soles) && leads(goal_.kind);
  if ((goal_.kind == StepKind::kFloor || leads_down) && plan.shape.retreat_m < 0.0) plan.shape.retreat_m -= ahead_m;
  path_.plan(gait.robot.sole, start, goal_.target, plan.shape, plan.swing_ticks);
  body.move_torso(plan.touch_down, plan.swing_ticks, plan.rise_ticks);
  zmp_stance_m_ = plan.zmp_stance_m;
  gait.planner.latched(situation(in), decision);

  LatchedStep& step = gait.status.step;
  step = {
      .sequence = step.sequence + 1,
      .foot = goal_.foot,
      .onto_tread = onto_tread(goal_.kind),
      .height_mapped = onto_tread(goal_.kind) && goal_.kind != StepKind::kClosing && goal_.foothold.last_seen_ns > 0,
      .latch_stamp_ns = in.now_ns,
      .map_stamp_ns = in.footholds.map_stamp_ns,
      .target = goal_.foothold,
      .odom_T_target = goal_.target.transform(),
      .touch_down_stamp_ns = 0,
      .odom_T_executed = {}};
  gait.status.phase = GaitPhase::kSwing;
  gait.status.stands[index_of(goal_.foot)] = false;
  heel_up_rad_ = body.heel_up_rad(goal_.foot);
  body.stand_on_toe(goal_.foot, 0.0);
  gait.memory.shifts = gait.memory.idle_ticks = gait.memory.obstacle_ticks = gait.memory.refusals = 0;
  gait.memory.rests_first = false;
  body.release_landed_foot();
}

// Legs give way under load, and a foot stands millimetres from where it is planned: back it goes to where it
// stood, if the estimate told that.
Transform SwingPhase::sole() const noexcept {
  Transform odom_T_sole = path_.at(timing_.tick());
  if (timing_.goes_back() && turn_tick_ > 0.0) {
    odom_T_sole.p_m += (1.0 - std::max(timing_.tick(), 0.0) / turn_tick_) * odom_off_path_m_;
  }
  return odom_T_sole;
}

StepAhead SwingPhase::ahead(const ClimbPlanner& planner) const noexcept {
  StepAhead step;
  step.goal = &goal_;
  step.lift_off_ticks = 0;
  step.returns = timing_.goes_back();
  if (step.returns) {
    step.back_to = path_.at(0.0);
    return step;
  }
  if (leads(goal_.kind)) step.after = &planner.latched_decision().trailing;
  const double left = std::max(path_.duration_ticks() - timing_.tick() + 1.0, 1.0) / std::max(timing_.pace(), 1.0);
  step.swing_ticks = static_cast<std::int32_t>(std::ceil(left));
  return step;
}

bool SwingPhase::feel_force(const GaitInput& in, const SwingParams& params, std::int64_t steer_age_ns) noexcept {
  if (in.now_ns - in.feedback.stamp_ns > steer_age_ns) {  // what was felt then tells nothing of now
    touch_ = {};
    early_touch_.release();
  }
  if (std::exchange(felt_stamp_ns_, in.feedback.stamp_ns) == in.feedback.stamp_ns) return false;
  const std::size_t foot = index_of(goal_.foot);
  // What masses and friction feign grows with the leg's accelerations: with the pace squared of a foot that hurries.
  // Down in search of the ground it gathers speed gently.
  const bool searches = timing_.tick() > path_.duration_ticks();
  const double hurry = searches ? 1.0 : std::max(timing_.pace(), 1.0);
  touch_.take(params.touch, in.feedback.foot_force_n[foot], math::square(hurry) * in.state.foot_force_sigma_n[foot]);
  if (touch_.hangs()) unloaded_ = true;
  return true;
}

SwingPhase::Contact SwingPhase::feel(const GaitInput& in, const SwingParams& params, std::int64_t steer_age_ns,
                                     const Transform& odom_T_sole) noexcept {
  const bool sampled = feel_force(in, params, steer_age_ns);
  Contact contact;
  const double above_target_m = path_.at(timing_.last_tick()).p_m.z() - goal_.target.position_m.z();
  if (above_target_m > params.early.from_m) contact.early_m = above_target_m;
  const bool may_land = unloaded_ && 2.0 * timing_.tick() > path_.duration_ticks();
  if (!may_land || contact.early_m == 0.0) {
    early_touch_.release();
  } else if (sampled) {
    early_touch_.take(params.early, params.touch, touch_, in.feedback.foot_force_n[index_of(goal_.foot)]);
  }
  contact.felt = contact.early_m > 0.0 ? early_touch_.lands() : touch_.touches(params.touch, false);
  // What does not go down any more stands on something, whatever its force sensor says.
  const bool judged = in.usable && !in.leg_impaired;  // a mute leg stays above its path, too
  const double above_m = judged ? in.state.odom_T_sole[index_of(goal_.foot)].p_m.z() - odom_T_sole.p_m.z() : 0.0;
  const bool blocked = path_.lowered_m(timing_.tick()) > params.late_m && above_m > params.blocked_m;
  contact.ground = (may_land && contact.felt) || blocked;
  return contact;
}

Transition SwingPhase::tick(const GaitInput& in, GaitShared& gait) noexcept {
  const SwingParams& params = gait.params.swing;
  if (timing_.goes_back()) return abort_swing(in, gait);
  // An impaired leg has drives that may not follow another path.
  const bool lands_soon = in.usable && !in.leg_impaired && timing_.may_land_sooner();
  if (lands_soon && goal_.kind == StepKind::kPassing) land_soon(gait);
  const Transform odom_T_sole = sole();
  const double lowered_m = path_.lowered_m(timing_.tick());
  const bool was_stopped = early_touch_.stops();
  const Contact contact = feel(in, params, gait.params.steer_age_ns, odom_T_sole);
  if (early_touch_.stops() && !was_stopped) gait.plan.restart_posture();
  if (contact.ground) {
    if (contact.early_m > 0.0) ++gait.status.early_contacts;
    if (lowered_m > params.late_m) ++gait.status.late_contacts;
    return touch_down(in, gait, contact.felt, contact.early_m);
  }
  // A force that never left or is no longer told: the plan's end is the touch-down.
  const bool told = in.now_ns - in.feedback.stamp_ns <= gait.params.steer_age_ns &&
                    std::isfinite(in.feedback.foot_force_n[index_of(goal_.foot)]);
  if (!(unloaded_ && told) && timing_.tick() > path_.duration_ticks()) return touch_down(in, gait, false, 0.0);
  if (lowered_m > params.max_lowering_m && leg_was_mute_) {  // the leg keeps the foot up: down with the body
    lowers_body_ = gait.plan.try_lower(gait.params.held_body);
    return lowers_body_ ? Transition{} : touch_down(in, gait, false, 0.0);
  }
  if (lowered_m > params.max_lowering_m) {  // the ground that was seen is not there
    ++gait.status.late_contacts;
    timing_.retreat(params.timing);
    gait.plan.restart_posture();
    wait_over_stance(gait, start_flat(gait));
    return {};
  }
  // The ground is late: the leg is to reach farther down.
  const double late_tick = path_.duration_ticks() + gait.params.step.landing_hold_ticks;
  if (timing_.tick() >= late_tick && timing_.last_tick() < late_tick) {
    SolePose lowest = sole_pose(gait.plan.plan_T_sole(goal_.foot));
    lowest.position_m.z() -= params.max_lowering_m;
    lower_torso(gait, lowest);
  }
  gait.plan.set_sole(goal_.foot, beside_path(gait.plan, odom_T_sole));
  return {};
}

// In the plan's frame, as far beside the path as the timing has it.
Transform SwingPhase::beside_path(const BodyPlan& plan, const Transform& odom_T_sole) const noexcept {
  Transform plan_T_sole = plan.plan_T_odom() * odom_T_sole;
  plan_T_sole.p_m += plan.plan_T_sole(other(goal_.foot)).R.col(1) * (side_sign(goal_.foot) * timing_.widened_m());
  return plan_T_sole;
}

// A foot that follows down goes on whatever happens: its body is over the other one.
SwingPhase::Turns SwingPhase::turns_until(const GaitInput& in, const SwingParams& params) const noexcept {
  if (heel_up_rad_ > 0.0) return {};
  const bool reaches_back = on_level(goal_.kind) || goal_.kind == StepKind::kLeading;
  const bool reaches_shortly = goal_.kind == StepKind::kPassing;  // the torso rises, and leaves its leg too short
  Turns turns;
  turns.by_itself_tick = in.leg_impaired   ? params.abort_mute_share * path_.duration_ticks()
                         : reaches_back    ? params.abort_share * path_.duration_ticks()
                         : reaches_shortly ? params.abort_passing_ticks
                                           : 0.0;
  // Back to another tread the body topples, which is on its way from there: on it goes where that takes no longer.
  if (in.stop_requested != StopReason::kOperator) return turns;
  turns.asked_tick = reaches_back ? params.abort_passing_ticks : path_.duration_ticks() - params.stop_ticks;
  return turns;
}

void SwingPhase::follow(const GaitInput& in, GaitShared& gait) noexcept {
  for (std::size_t j = 0; j < kJointsPerLeg && in.leg_impaired; ++j) {
    leg_was_mute_ = leg_was_mute_ || in.feedback.is_mute(joint_index(goal_.foot, j));
  }
  if (lowers_body_) return;  // the foot is as low on its path as it gets
  const SwingParams& params = gait.params.swing;
  const Transform& stance = gait.plan.plan_T_sole(other(goal_.foot));
  const Turns turns = turns_until(in, params);
  const bool went_back = timing_.goes_back();
  // A plan that has just been stopped, or has just gone on, is no body that falls.
  unjudged_ticks_ = in.mute ? params.unjudged_ticks : std::max(unjudged_ticks_ - 1, 0);
  const Vec2 error_m = unjudged_ticks_ > 0 && !in.lost ? Vec2::Zero() : in.odom_dcm_error_m;
  timing_.advance(params.timing,
                  {.falling_outward_m = side_sign(goal_.foot) * error_m.dot(stance.R.col(1).head<2>()),
                   .falling_ahead_m = error_m.dot(stance.R.col(0).head<2>()),
                   .turn_until_tick = turns.by_itself_tick,
                   .drive_share = gait.plan.drive_share(gait.robot.drives, goal_.foot),
                   .side_room_m = goal_.foothold.side_room_m[index_of(goal_.foot)] - params.side_margin_m,
                   .wanted_back = timing_.tick() < (in.leg_impaired ? turns.by_itself_tick : turns.asked_tick),
                   .may_hurry = !in.leg_impaired,
                   .stopped = early_touch_.stops()},
                  path_.duration_ticks());
  if (!timing_.goes_back()) return;
  turn_tick_ = std::max(turn_tick_, timing_.tick());  // the pace takes some ticks to turn, too
  if (went_back) return;
  // The body was on its way up and ahead, to a target where no foot will stand.
  wait_over_stance(gait, start_flat(gait));
}

// Of a passing foot, the rest of the way straight to the target, or beside the standing foot while it is still behind
// it.
void SwingPhase::land_soon(GaitShared& gait) noexcept {
  const SwingParams& params = gait.params.swing;
  const StepParams& step = gait.params.step;
  BodyPlan& body = gait.plan;
  const SolePose stance = sole_pose(body.odom_T_plan() * body.plan_T_sole(other(goal_.foot)));
  const Mat3 R = rotation_z(stance.yaw_rad);
  const Transform now = sole();
  const bool beside = (R.transpose() * (now.p_m - stance.position_m)).x() < -params.beside_from_m;
  const SolePose target = beside ? gait.planner.beside_passed(stance, goal_.foot) : goal_.target;
  const Vec3 way_m = target.position_m - now.p_m;
  const auto ticks = static_cast<std::int32_t>(params.soon_ticks + params.soon_ticks_per_m * way_m.norm());
  // Below its nosing the tread is not to be had straight, and toes point down.
  const double toe_m = (now * Vec3{gait.robot.sole.collision.toe_x_m, 0.0, 0.0}).z();
  const bool from_below = target.position_m.z() - std::min(toe_m, now.p_m.z()) > params.soon_below_m;
  if (from_below || timing_.tick() + ticks >= path_.duration_ticks()) return;
  body.carry_to_odometry();
  if (beside) land_beside(gait, target);
  const SolePair soles = body.soles();
  StepPlan plan = plan_step(step, goal_, soles, tried_);
  plan.swing_ticks = ticks;
  ComPlan& com = body.renewed_com();
  com.plan(step.com, body.com(), zmp_of_swing(plan));
  plan_torso(gait.robot.legs, step, soles, com, 0, plan);
  body.move_torso(plan.touch_down, ticks, ticks);
  path_.redirect(timing_.tick(), timing_.pace(), target, ticks);
  odom_off_path_m_.setZero();  // the path begins elsewhere now
  timing_.begin_straight();
  zmp_stance_m_ = plan.zmp_stance_m;
}

// The step's new goal: the standing foot's tread.
void SwingPhase::land_beside(GaitShared& gait, const SolePose& target) noexcept {
  goal_.kind = StepKind::kTrailing;
  goal_.target = target;
  goal_.foothold = {.position_m = target.position_m,
                    .yaw_rad = target.yaw_rad,
                    .up = target.up,
                    .polygon_id = gait.planner.tread_id(),
                    .last_seen_ns = goal_.foothold.last_seen_ns,
                    .side_room_m = goal_.foothold.side_room_m};  // as much as above: both are of one staircase
  gait.planner.passing_ends_beside(goal_);
  LatchedStep& step = gait.status.step;
  step.target = goal_.foothold;
  step.odom_T_target = target.transform();
  step.height_mapped = false;
}

// The only way that is known to be free is the one it came: the swing backwards.
Transition SwingPhase::abort_swing(const GaitInput& in, GaitShared& gait) noexcept {
  const SwingParams& params = gait.params.swing;
  (void)feel_force(in, params, gait.params.steer_age_ns);
  const Transform odom_T_sole = sole();
  const double above_m = odom_T_sole.p_m.z() - path_.start_height_m();
  const bool felt = touch_.touches(params.touch, false), all_the_way = timing_.tick() < 0.0;
  const bool lands = felt && (all_the_way || (unloaded_ && above_m < params.abort_landing_m));
  if (!lands && !(all_the_way && above_m < -params.abort_landing_m)) {
    gait.plan.set_sole(goal_.foot, beside_path(gait.plan, odom_T_sole));
    return {};
  }
  stop_foot(in, gait);
  gait.plan.stand_on_toe(goal_.foot, heel_up_rad_);  // as it stood; the heel comes down from there
  if (!felt && std::isfinite(in.feedback.foot_force_n[index_of(goal_.foot)])) gait.plan.keep_upright();
  ++gait.status.aborted_swings;
  gait.planner.swing_aborted();
  gait.plan.restart_posture();
  gait.plan.carry_to_odometry();
  gait.status.phase = GaitPhase::kDoubleSupport;
  gait.memory.rests_first = true;
  if (timing_.no_ground()) return Transition::stop(StopReason::kGroundMissing);
  if (++gait.memory.aborted_swings >= params.max_aborted) return Transition::stop(StopReason::kToppling);
  return Transition::stand();
}

Transition SwingPhase::touch_down(const GaitInput& in, GaitShared& gait, bool felt, double early_m) noexcept {
  const std::size_t i = index_of(goal_.foot);
  BodyPlan& body = gait.plan;
  LatchedStep& step = gait.status.step;
  step.touch_down_stamp_ns = in.now_ns;
  stop_foot(in, gait);
  step.odom_T_executed = in.usable ? in.state.odom_T_sole[i] : body.odom_T_plan() * body.plan_T_sole(goal_.foot);
  body.land(goal_.foot, felt, early_m, in.now_ns);
  if (!felt && std::isfinite(in.feedback.foot_force_n[i])) body.keep_upright();
  gait.memory.aborted_swings = 0;
  gait.planner.landed(in.usable ? std::optional(situation(in).soles) : std::nullopt);
  gait.status.treads_climbed = gait.planner.treads_climbed();
  gait.status.phase = GaitPhase::kDoubleSupport;
  body.carry_to_odometry();
  return Transition::stand();
}

// A mute knee has it elsewhere than the plan; it stays where it is commanded.
void SwingPhase::stop_foot(const GaitInput& in, GaitShared& gait) const noexcept {
  gait.status.stands[index_of(goal_.foot)] = true;
  if (!in.leg_impaired) return;
  gait.plan.set_sole(goal_.foot, gait.plan.plan_T_base() * in.joints.base_T_sole_reference(goal_.foot));
}

// Where the foot stood, flat, plan frame.
SolePose SwingPhase::start_flat(const GaitShared& gait) const noexcept {
  return sole_pose(gait.plan.plan_T_odom() * path_.at(0) * turned_about_toe(gait.robot.sole, -heel_up_rad_));
}

// As low as the sole asks for, plan frame, and the standing one allows.
void SwingPhase::lower_torso(GaitShared& gait, const SolePose& sole) const noexcept {
  SolePair soles = gait.plan.soles();
  soles[index_of(goal_.foot)] = sole;
  TorsoPose low = torso_over(gait.robot.legs, gait.params.step.torso, other(goal_.foot), soles);
  double& height_m = low.position_m.z();
  height_m = std::min(height_m - gait.params.swing.lowering_spare_m, gait.plan.height_m());
  const std::int32_t ticks = lowering_ticks(gait.params.step.torso, gait.plan.height_m() - height_m);
  gait.plan.move_torso(low, ticks, ticks);
}

// The foot goes back: the weight rests over the stance foot, as far towards the free foot as the sole carries. The
// ankle roll of a folded leg has little range.
void SwingPhase::wait_over_stance(GaitShared& gait, const SolePose& sole) const noexcept {
  lower_torso(gait, sole);
  const Vec3 inward_m =
      gait.plan.plan_T_sole(other(goal_.foot)).R.col(1) * (side_sign(goal_.foot) * gait.params.swing.wait_inward_m);
  gait.plan.rest_over(gait.params.step.com, zmp_stance_m_ + inward_m.head<2>());
}

}  // namespace polygmap
