// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/step_plan.hpp"

#include <algorithm>

#include "algorithms/robot/leg_dynamics.hpp"

namespace polygmap {

StepPlan plan_step(const StepParams& params, const StepGoal& goal, const SolePair& soles,
                   const StepTry& tried) noexcept {
  const bool on_floor = goal.kind == StepKind::kFloor, passing = goal.kind == StepKind::kPassing;
  const Foot stance = other(goal.foot);
  SolePair landed = soles;
  landed[index_of(goal.foot)] = goal.target;

  StepPlan plan;
  plan.goal = goal;
  plan.shape = on_floor ? params.floor_swing : passing ? params.passing_swing : params.stair_swing;
  plan.shift_ticks = on_floor ? params.floor_shift_ticks : params.stair_shift_ticks;
  const std::int32_t usual_ticks = on_floor  ? params.floor_swing_ticks
                                   : passing ? params.passing_swing_ticks
                                             : params.stair_swing_ticks;
  plan.swing_ticks = static_cast<std::int32_t>(tried.longer * usual_ticks);
  const double rise_share = on_floor ? 1.0 : passing ? params.passing_rise_share : params.rise_share;
  plan.rise_ticks = static_cast<std::int32_t>(rise_share * plan.swing_ticks);
  plan.tried = tried;
  plan.shape.toe_down_rad = on_floor ? 0.5 * tried.toe_down_rad : tried.toe_down_rad;
  const auto zmp_in = [&](Foot foot) -> Vec2 {
    const SolePose& sole = landed[index_of(foot)];
    const Vec3 local_m{params.zmp_ahead_m, -side_sign(foot) * params.zmp_inward_m, 0.0};
    return (sole.position_m + rotation_z(sole.yaw_rad) * local_m).head<2>();
  };
  plan.zmp_stance_m = zmp_in(stance);
  // After a step that leads the weight goes on to that foot; after the others it may have to stop anywhere.
  plan.zmp_next_m = zmp_in(goal.foot);
  if (!leads(goal.kind)) plan.zmp_next_m = 0.5 * (plan.zmp_next_m + plan.zmp_stance_m);
  return plan;
}

void plan_torso(const LegGeometry& geometry, const StepParams& params, const SolePair& soles, const ComPlan& com,
                std::int32_t lift_off_tick, StepPlan& plan) noexcept {
  SolePair landed = soles;
  landed[index_of(plan.goal.foot)] = plan.goal.target;
  plan.lift_off = torso_at(geometry, params.torso, soles, com.at(lift_off_tick + params.leave_ticks).position_m);
  plan.touch_down = torso_at(geometry, params.torso, landed, com.at(lift_off_tick + plan.swing_ticks).position_m);
  if (!leads(plan.goal.kind)) return;
  // Rising with the foot gives the leading leg room to fold, at a lower knee speed.
  const double tall_m = soles[index_of(other(plan.goal.foot))].position_m.z() + params.torso.lead_height_m;
  plan.touch_down.position_m.z() = std::min(plan.touch_down.position_m.z(), tall_m);
}

ZmpKnots zmp_of_swing(const StepParams& params, const StepPlan& plan) noexcept {
  const std::int32_t stay = plan.swing_ticks + params.landing_hold_ticks;
  const std::int32_t ramp = params.stair_shift_ticks - params.landing_hold_ticks - params.lift_hold_ticks;
  ZmpKnots knots;
  (void)knots.try_push_back({stay, plan.zmp_stance_m});
  (void)knots.try_push_back({stay + std::max(ramp, 1), plan.zmp_next_m});
  return knots;
}

ZmpKnots zmp_of_shift(const StepParams& params, const StepPlan& plan, const Vec2& start_m) noexcept {
  ZmpKnots knots;
  const std::int32_t over = std::max(plan.shift_ticks - params.lift_hold_ticks, 2);
  const std::int32_t ramp = params.stair_shift_ticks - params.landing_hold_ticks - params.lift_hold_ticks;
  (void)knots.try_push_back({std::max(over - ramp, over / 5), start_m});
  (void)knots.try_push_back({over, plan.zmp_stance_m});
  for (const ZmpKnot& knot : zmp_of_swing(params, plan)) {
    (void)knots.try_push_back({plan.shift_ticks + knot.tick, knot.zmp_m});
  }
  return knots;
}

void plan_shift(const StepParams& params, const HorizontalMotion& from, std::int32_t least_ticks, StepPlan& plan,
                ComPlan& com) noexcept {
  constexpr std::array<std::int32_t, 10> kLonger_ticks{0, -35, -70, 50, 100, 150, 200, 300, 400, 500};
  const Vec2 start_m = ComPlan::zmp_under(params.com, from);
  const std::int32_t usual_ticks = plan.shift_ticks;
  const auto try_shift = [&](std::int32_t ticks) {
    plan.shift_ticks = ticks;
    com.plan(params.com, from, zmp_of_shift(params, plan, start_m));
    return com.push_m();
  };
  std::int32_t best_ticks = usual_ticks;
  double least_m = 1e9;
  for (const std::int32_t longer : kLonger_ticks) {
    const std::int32_t ticks = std::max(usual_ticks + longer, least_ticks);
    const double push_m = try_shift(ticks);
    if (push_m < least_m) {
      least_m = push_m;
      best_ticks = ticks;
    }
    if (push_m <= params.max_push_m) break;
  }
  (void)try_shift(best_ticks);
}

StepKnots::StepKnots(const LegGeometry& geometry, const StepParams& params, const StepPlan& step,
                     const TorsoTrajectory::State& from, const std::array<Transform, kFootCount>& soles) noexcept
    : foot_(step.goal.foot),
      soles_(soles),
      shift_ticks_(step.shift_ticks),
      swing_ticks_(step.swing_ticks),
      knot_ticks_(std::max(params.knot_ticks, 1)),
      count_(1 + (step.shift_ticks + step.swing_ticks + knot_ticks_ - 1) / knot_ticks_) {
  const HorizontalMotion com = TorsoTrajectory::horizontal(from);
  com_.plan(params.com, com, zmp_of_shift(params, step, ComPlan::zmp_under(params.com, com)));
  StepPlan plan = step;
  plan_torso(geometry, params, {sole_pose(soles[0]), sole_pose(soles[1])}, com_, plan.shift_ticks, plan);
  torso_at_landing_ = plan.touch_down;
  shift_.plan(from, plan.lift_off.position_m.z(), plan.lift_off.yaw_rad, plan.shift_ticks, plan.shift_ticks);
  lean_.plan(shift_.at(plan.shift_ticks, com), plan.touch_down.position_m.z(), plan.touch_down.yaw_rad,
             plan.swing_ticks, plan.rise_ticks);
  swing_.plan(soles[index_of(foot_)], plan.goal.target, plan.shape, plan.swing_ticks);
}

StepKnot StepKnots::operator[](std::int32_t i) const noexcept {
  StepKnot knot;
  knot.tick = i * knot_ticks_;
  knot.odom_T_sole = soles_;
  const std::int32_t swing_tick = std::min(knot.tick - shift_ticks_, swing_.duration_ticks());
  if (swing_tick < 0) {
    knot.odom_T_base = TorsoTrajectory::pose(shift_.at(knot.tick, com_.at(knot.tick)));
  } else {
    knot.odom_T_base = TorsoTrajectory::pose(lean_.at(swing_tick, com_.at(knot.tick)));
    knot.odom_T_sole[index_of(foot_)] = swing_.at(swing_tick);
  }
  return knot;
}

void StepFeasibility::begin(const LegGeometry& geometry, const StepParams& params, const StepKnots& knots) noexcept {
  geometry_ = geometry;
  params_ = params;
  knots_ = knots;
  check_ = {true, 1e9, 1e9, 0.0};
  next_ = 0;
  constexpr int kPasses = 3;  // of base and legs that follow each other
  previous_.setZero();
  for (int i = 0; i < kPasses; ++i) (void)solve(0, previous_, previous_);
}

bool StepFeasibility::solve(std::int32_t i, const JointVector& before_rad, JointVector& q_rad) const noexcept {
  StepKnot knot = knots_[i];
  const Vec3 base_p_com = centre_of_mass_m(masses_, base_p_links_m(masses_, body_frames(geometry_, before_rad)));
  knot.odom_T_base.p_m.head<2>() -= (knot.odom_T_base.R * base_p_com).head<2>();
  const Transform base_T_odom = knot.odom_T_base.inverse();
  bool reachable = true;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegSolution s = solve_leg(geometry_, leg, base_T_odom * knot.odom_T_sole[index_of(leg)]);
    reachable = reachable && s.reachable;
    q_rad.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0))) = s.q_rad;
  }
  return reachable;
}

bool StepFeasibility::advance(std::int32_t count) noexcept {
  const std::int32_t end = std::min(next_ + count, knots_.count());
  for (; next_ < end; ++next_) {
    JointVector q_rad;
    if (!solve(next_, previous_, q_rad)) check_.feasible = false;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const std::size_t j = n % kJointsPerLeg;
      const JointLimits& limits = joint_limits(static_cast<Foot>(n / kJointsPerLeg), j);
      const auto i = static_cast<Eigen::Index>(n);
      // The knee's lower end is the stretched leg, which has a margin of its own.
      double& low = j == kKnee ? check_.knee_rad : check_.joint_margin_rad;
      low = std::min(low, q_rad[i] - limits.min_rad);
      check_.joint_margin_rad = std::min(check_.joint_margin_rad, limits.max_rad - q_rad[i]);
      if (next_ > 0) {
        const double speed_radps = std::abs(q_rad[i] - previous_[i]) / (knots_.knot_ticks() * kTick_s);
        check_.speed_share = std::max(check_.speed_share, speed_radps / limits.speed_radps);
      }
    }
    previous_ = q_rad;
    check_.feasible = check_.feasible && check_.joint_margin_rad >= params_.joint_margin_rad &&
                      check_.knee_rad >= params_.knee_min_rad && check_.speed_share <= params_.speed_share;
    if (!check_.feasible) return true;
  }
  return next_ == knots_.count();
}

void StepSearch::begin(const LegGeometry& geometry, const StepParams& params, const StepGoal& goal,
                       const StepGoal& trailing, std::int32_t shift_ticks, const TorsoTrajectory::State& from,
                       const std::array<Transform, kFootCount>& soles) noexcept {
  geometry_ = geometry;
  params_ = params;
  goal_ = goal;
  trailing_ = trailing;
  shift_ticks_ = shift_ticks;
  from_ = from;
  soles_ = soles;
  try_ = 0;
  leading_found_ = false;
  state_ = State::kSearching;
  try_candidate();
}

void StepSearch::try_candidate() noexcept {
  const StepGoal& goal = leading_found_ ? trailing_ : goal_;
  std::array<Transform, kFootCount> soles = soles_;
  TorsoTrajectory::State from = from_;
  if (leading_found_) {
    soles[index_of(goal_.foot)] = goal_.target.transform();
    from = TorsoTrajectory::at_rest({rotation_z(torso_landed_.yaw_rad), torso_landed_.position_m});
    TorsoTrajectory::set_horizontal(from, com_landed_);
  }
  const StepTries& tries = goal.kind == StepKind::kPassing ? kPassingTries : kStepTries;
  candidate_ = plan_step(params_, goal, {sole_pose(soles[0]), sole_pose(soles[1])}, tries[try_]);
  if (!leading_found_) candidate_.shift_ticks = shift_ticks_;
  StepParams params = params_;
  if (leading_found_) params.knot_ticks *= kLookAhead;
  proof_.begin(geometry_, params, StepKnots(geometry_, params, candidate_, from, soles));
}

// Can the weight then move over the foot that landed? A wide diagonal step could be a dead end: the ankle roll of the
// leg left behind.
bool StepSearch::leads_on() const noexcept {
  SolePair landed{sole_pose(soles_[0]), sole_pose(soles_[1])};
  landed[index_of(goal_.foot)] = goal_.target;
  const TorsoPose over = torso_over(geometry_, params_.torso, goal_.foot, landed);
  const Transform base_T_odom = Transform{rotation_z(over.yaw_rad), over.position_m}.inverse();
  const double margin_rad = 2.0 * params_.joint_margin_rad;  // the foot lands some mm off
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegSolution s = solve_leg(geometry_, leg, base_T_odom * landed[index_of(leg)].transform());
    if (!s.reachable || s.q_rad[kKnee] < params_.knee_min_rad) return false;
    LegVector q_rad = s.q_rad;
    q_rad[kKnee] = std::max(q_rad[kKnee], margin_rad);  // the stretched leg has a margin of its own
    if (limit_margin_rad(leg, q_rad) < margin_rad) return false;
  }
  return true;
}

StepSearch::State StepSearch::step() noexcept {
  if (state_ != State::kSearching || !proof_.advance(kKnotsPerCall)) return state_;
  if (!proof_.check().feasible) {
    if (++try_ == kStepTryCount) return state_ = State::kImpossible;
  } else {
    if (!leading_found_) plan_ = candidate_;
    if (goal_.kind == StepKind::kFloor && !leads_on()) return state_ = State::kImpossible;
    if (leading_found_ || !leads(goal_.kind)) return state_ = State::kFound;
    leading_found_ = true;
    com_landed_ = proof_.knots().com_at_landing();
    torso_landed_ = proof_.knots().torso_at_landing();
    try_ = 0;
  }
  try_candidate();
  return state_;
}

}  // namespace polygmap
