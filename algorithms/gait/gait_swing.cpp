// SPDX-License-Identifier: Apache-2.0
// The gait's swings: from lift-off to touch-down, or back to where the foot stood.
#include <algorithm>
#include <utility>

#include "algorithms/gait/gait.hpp"

namespace polygmap {

void Gait::lift_off(const StateEstimate& state, const FootholdSet& footholds,
                    const ClimbPlanner::Decision& decision) noexcept {
  // The leg that carries now puts the base elsewhere than the two of them did: take it from there, and level it.
  carry_plan_to_odometry();
  const StepGoal& goal = decision.goal;
  const SolePair soles{sole_pose(plan_T_sole_[0]), sole_pose(plan_T_sole_[1])};
  StepPlan plan = plan_step(params_.step, goal, soles, search_.plan().tried);
  com_.plan(params_.step.com, TorsoTrajectory::horizontal(torso_state_), zmp_of_swing(params_.step, plan));
  plan_torso(params_.geometry, params_.step, soles, com_, 0, plan);
  swing_.plan(plan_T_sole_[index_of(goal.foot)], goal.target, plan.shape, plan.swing_ticks);
  move_torso(plan.touch_down.position_m.z(), plan.touch_down.yaw_rad, plan.swing_ticks, plan.rise_ticks);
  com_tick_ = 0;
  zmp_stance_m_ = plan.zmp_stance_m;
  planner_.latched(situation(state), decision);
  decision_ = decision;

  LatchedStep& step = status_.step;
  step = {.sequence = step.sequence + 1,
          .foot = goal.foot,
          .onto_tread = onto_tread(goal.kind),
          .height_mapped = onto_tread(goal.kind),
          .latch_stamp_ns = now_ns_,
          .map_stamp_ns = footholds.map_stamp_ns,
          .target = goal.foothold,
          .odom_T_target = goal.target.transform(),
          .touch_down_stamp_ns = 0,
          .odom_T_executed = {}};
  status_.phase = GaitPhase::kSwing;
  status_.stands[index_of(goal.foot)] = false;
  activity_ = Activity::kSwing;
  tick_ = 0;
  shifts_ = 0;
  idle_ticks_ = 0;
  if (settles_) posture_.restart();
  unloaded_ = retried_ = settles_ = false;
  felt_ = false;
  touched_ticks_ = 0;
  pace_.begin();
}

void Gait::swing(const StateEstimate& state, const JointFeedback& feedback) noexcept {
  if (pace_.goes_back()) return put_back(feedback);
  if (usable_ && pace_.hurries() && decision_.goal.kind == StepKind::kPassing) land_soon(state);
  const Foot foot = decision_.goal.foot;
  const std::size_t i = index_of(foot);
  const bool loaded = feedback.foot_force_n[i] > params_.touch_force_n;
  if (!loaded) unloaded_ = true;
  // Each sample once: of a bus that falls silent the last one is read on and on.
  if (std::exchange(felt_stamp_ns_, feedback.stamp_ns) != feedback.stamp_ns) {
    touched_ticks_ = loaded ? touched_ticks_ + 1 : 0;
  }
  const bool descending = 2.0 * pace_.tick() > swing_.duration_ticks();
  // What does not go down any more stands on something, whatever its force sensor says.
  const Transform odom_T_sole = swing_.at(pace_.tick());
  const double above_m = usable_ ? state.odom_T_sole[i].p_m.z() - odom_T_sole.p_m.z() : 0.0;
  const bool blocked = swing_.lowered_m(pace_.tick()) > params_.late_m && above_m > params_.blocked_m;
  // A toe that scrapes along the next riser feels a force too, for a moment: ground that comes early has to stay.
  const bool early = swing_.at(pace_.last_tick()).p_m.z() > decision_.goal.target.position_m.z() + params_.early_m;
  const bool touches = loaded && touched_ticks_ >= (early ? params_.scrape_ticks : 1);
  if ((descending && unloaded_ && touches) || blocked) {
    felt_ = loaded;
    if (early) ++status_.early_contacts;
    if (swing_.lowered_m(pace_.tick()) > params_.late_m) ++status_.late_contacts;
    return touch_down(state);
  }
  // A force that never left or is no longer told: the plan's end is the touch-down.
  const bool told = now_ns_ - feedback.stamp_ns <= params_.steer_age_ns;
  if (!(unloaded_ && told) && pace_.tick() > swing_.duration_ticks()) return touch_down(state);
  if (swing_.lowered_m(pace_.tick()) > params_.max_lowering_m) {  // the ground that was seen is not there
    ++status_.late_contacts;
    pace_.retreat(params_.pace);
    posture_.restart();
    wait_over_stance(sole_pose(correction_.odom_T_plan(plan_T_base_).inverse() * swing_.at(0)));
    return;
  }
  // The ground is late: the leg is to reach farther down.
  const double late_tick = swing_.duration_ticks() + params_.step.landing_hold_ticks;
  if (pace_.tick() >= late_tick && pace_.last_tick() < late_tick) {
    SolePose lowest = sole_pose(plan_T_sole_[i]);
    lowest.position_m.z() -= params_.max_lowering_m;
    lower_torso(lowest);
  }
  plan_T_sole_[i] = beside_path(odom_T_sole);
}

// The swing foot in the plan's frame, as far beside its path as the pace has it.
Transform Gait::beside_path(const Transform& odom_T_sole) const noexcept {
  const Foot foot = decision_.goal.foot;
  Transform plan_T_sole = correction_.odom_T_plan(plan_T_base_).inverse() * odom_T_sole;
  plan_T_sole.p_m += plan_T_sole_[index_of(other(foot))].R.col(1) * (side_sign(foot) * pace_.wider_m());
  return plan_T_sole;
}

void Gait::set_pace() noexcept {
  const StepGoal& goal = decision_.goal;
  const Transform& stance = plan_T_sole_[index_of(other(goal.foot))];
  const bool reaches_back = goal.kind == StepKind::kFloor || goal.kind == StepKind::kLeading;
  const bool reaches_shortly = goal.kind == StepKind::kPassing;  // the torso rises, and leaves its leg too short
  const double until = reaches_back      ? params_.turn_share * swing_.duration_ticks()
                       : reaches_shortly ? params_.turn_ticks
                                         : 0.0;
  const bool went_back = pace_.goes_back();
  pace_.advance(params_.pace,
                {.toppling_m = side_sign(goal.foot) * dcm_error_m_.dot(stance.R.col(1).head<2>()),
                 .turn_until_tick = until,
                 .drive_share = posture_.drive_share(goal.foot),
                 .side_room_m = goal.foothold.side_room_m[index_of(goal.foot)] - params_.side_margin_m},
                swing_.duration_ticks());
  // The torso is on its way up: the foot is to reach where it stood all the same.
  if (pace_.goes_back() && !went_back) {
    lower_torso(sole_pose(correction_.odom_T_plan(plan_T_base_).inverse() * swing_.at(0)));
  }
}

// Of a passing foot, the rest of the way straight to the target, or beside the standing foot while it is still behind
// it.
void Gait::land_soon(const StateEstimate& state) noexcept {
  StepGoal& goal = decision_.goal;
  const Foot foot = goal.foot;
  const Transform odom_T_plan = correction_.odom_T_plan(plan_T_base_);
  const SolePose stance = sole_pose(odom_T_plan * plan_T_sole_[index_of(other(foot))]);
  const Mat3 R = rotation_z(stance.yaw_rad);
  const Transform now = swing_.at(pace_.tick());
  const Vec3& now_m = now.p_m;
  const bool beside = (R.transpose() * (now_m - stance.position_m)).x() < -params_.beside_from_m;
  const Vec3 beside_m = stance.position_m + R * Vec3{0.0, side_sign(foot) * 2.0 * kStanceHalfWidth_m, 0.0};
  const SolePose target = beside ? SolePose{beside_m, stance.yaw_rad} : goal.target;
  const Vec3 way_m = target.position_m - now_m;
  const auto ticks = static_cast<std::int32_t>(params_.soon_ticks + params_.soon_ticks_per_m * way_m.head<2>().norm());
  // Below its nosing the tread is not to be had straight, and toes point down.
  const double toe_m = (now * Vec3{kCollisionRectangle.toe_x_m, 0.0, 0.0}).z();
  if (target.position_m.z() - std::min(toe_m, now_m.z()) > params_.below_m ||
      pace_.tick() + ticks >= swing_.duration_ticks())
    return;
  carry_plan_to_odometry();
  if (beside) {
    goal.kind = StepKind::kTrailing;
    goal.target = target;
    const Transform world_T_sole = state.world_T_odom * target.transform();
    goal.foothold = {.position_m = world_T_sole.p_m,
                     .yaw_rad = yaw_of(world_T_sole.R),
                     .polygon_id = planner_.tread_id(),
                     .last_seen_ns = goal.foothold.last_seen_ns,
                     .side_room_m = goal.foothold.side_room_m};  // as much as above: both are of one staircase
    planner_.passing_ends_beside(goal);
    status_.step.target = goal.foothold;
    status_.step.odom_T_target = target.transform();
    status_.step.height_mapped = false;
  }
  const SolePair soles{sole_pose(plan_T_sole_[0]), sole_pose(plan_T_sole_[1])};
  StepPlan plan = plan_step(params_.step, goal, soles, search_.plan().tried);
  plan.swing_ticks = ticks;
  com_.plan(params_.step.com, TorsoTrajectory::horizontal(torso_state_), zmp_of_swing(params_.step, plan));
  com_tick_ = 0;
  plan_torso(params_.geometry, params_.step, soles, com_, 0, plan);
  move_torso(plan.touch_down.position_m.z(), plan.touch_down.yaw_rad, ticks, ticks);
  swing_.redirect(pace_.tick(), pace_.pace(), target, ticks);
  pace_.begin_straight();
  zmp_stance_m_ = plan.zmp_stance_m;
}

// The only way that is known to be free is the one it came: the swing backwards.
void Gait::put_back(const JointFeedback& feedback) noexcept {
  const std::size_t i = index_of(decision_.goal.foot);
  const Transform odom_T_sole = swing_.at(pace_.tick());
  const double above_m = odom_T_sole.p_m.z() - swing_.start_height_m();
  const bool loaded = feedback.foot_force_n[i] > params_.touch_force_n, all_the_way = pace_.tick() < 0.0;
  if ((loaded && (all_the_way || above_m < params_.put_back_m)) || (all_the_way && above_m < -params_.put_back_m)) {
    status_.stands[i] = true;
    ++status_.put_back;
    planner_.put_back();
    posture_.restart();
    carry_plan_to_odometry();
    status_.phase = GaitPhase::kDoubleSupport;
    begin_hold();
    retried_ = true;
    if (pace_.no_ground()) {
      end(GaitPhase::kStopped, StopReason::kGroundMissing, 0.0);
    } else if (++put_back_ >= params_.max_put_back) {
      end(GaitPhase::kStopped, StopReason::kToppling, 0.0);
    }
    return;
  }
  plan_T_sole_[i] = beside_path(odom_T_sole);
}

void Gait::touch_down(const StateEstimate& state) noexcept {
  const std::size_t i = index_of(decision_.goal.foot);
  status_.step.touch_down_stamp_ns = now_ns_;
  status_.step.odom_T_executed =
      usable_ ? state.odom_T_sole[i] : correction_.odom_T_plan(plan_T_base_) * plan_T_sole_[i];
  status_.stands[i] = true;
  odom_T_landed_ = correction_.odom_T_plan(plan_T_base_) * plan_T_sole_[i];
  settles_ = true;
  posture_.restart();  // the swing foot is where it was steered to, and stops
  plan_T_landed_ = plan_T_sole_[i];
  put_back_ = 0;
  planner_.landed();
  status_.treads_climbed = planner_.treads_climbed();
  status_.phase = GaitPhase::kDoubleSupport;
  carry_plan_to_odometry();
  begin_hold();
}

// Until it is pressed it would go along with what the base is off its plan: 5 mm towards the next riser.
void Gait::hold_landed_foot(const JointFeedback& feedback) noexcept {
  const std::size_t i = index_of(status_.step.foot);
  const std::int64_t most_ns = felt_ ? params_.felt_hold_ns : params_.hold_ns;
  settles_ = feedback.foot_force_n[i] < params_.hold_force_n && now_ns_ - status_.step.touch_down_stamp_ns < most_ns;
  if (settles_) {
    plan_T_sole_[i] = correction_.odom_T_plan(plan_T_base_).inverse() * odom_T_landed_;
  } else {
    posture_.restart();  // from where it was planned to where it was held
  }
}

}  // namespace polygmap
