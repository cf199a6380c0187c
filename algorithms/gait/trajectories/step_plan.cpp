// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/step_plan.hpp"

#include <algorithm>

namespace polygmap {

StepPlan plan_step(const StepParams& params, const StepGoal& goal, const SolePair& soles,
                   const StepTry& tried) noexcept {
  const bool on_floor = on_level(goal.kind), passing = goal.kind == StepKind::kPassing;
  const Foot stance = other(goal.foot);
  SolePair landed = soles;
  landed[index_of(goal.foot)] = goal.target;

  StepPlan plan;
  plan.goal = goal;
  plan.shape = on_floor ? params.floor_swing : passing ? params.passing_swing : params.stair_swing;
  plan.shift_ticks = on_floor ? params.durations.floor_shift_ticks : params.durations.stair_shift_ticks;
  const std::int32_t usual_ticks = on_floor  ? params.durations.floor_swing_ticks
                                   : passing ? params.durations.passing_swing_ticks
                                             : params.durations.stair_swing_ticks;
  plan.swing_ticks = static_cast<std::int32_t>(tried.longer * usual_ticks);
  const double rise_share = on_floor ? 1.0 : passing ? params.passing_rise_share : params.rise_share;
  plan.rise_ticks = static_cast<std::int32_t>(std::min(tried.rise_longer * rise_share, 1.0) * plan.swing_ticks);
  plan.tried = tried;
  const bool needed = goal.kind == StepKind::kClosing || goal.kind == StepKind::kTrailing;
  plan.joint_margin_rad = needed ? params.needed_margin_rad : params.joint_margin_rad;
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
  const std::int32_t ramp = params.durations.stair_shift_ticks - params.landing_hold_ticks - params.lift_hold_ticks;
  ZmpKnots knots;
  (void)knots.try_push_back({stay, plan.zmp_stance_m});
  (void)knots.try_push_back({stay + std::max(ramp, 1), plan.zmp_next_m});
  return knots;
}

ZmpKnots zmp_of_shift(const StepParams& params, const StepPlan& plan, const Vec2& start_m) noexcept {
  ZmpKnots knots;
  const std::int32_t over = std::max(plan.shift_ticks - params.lift_hold_ticks, 2);
  const std::int32_t ramp = params.durations.stair_shift_ticks - params.landing_hold_ticks - params.lift_hold_ticks;
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
  const auto knots_of = [&](std::int32_t ticks) {
    plan.shift_ticks = ticks;
    return zmp_of_shift(params, plan, start_m);
  };
  std::int32_t best_ticks = usual_ticks;
  double least_m = 1e9;
  for (const std::int32_t longer : kLonger_ticks) {
    const std::int32_t ticks = std::max(usual_ticks + longer, least_ticks);
    const double zmp_offset_m = ComPlan::zmp_offset_m(params.com, from, knots_of(ticks));
    const bool small = zmp_offset_m <= params.max_zmp_offset_m;
    // A great one must be over before the foot lifts: it would lift with weight on it.
    const bool over = ticks - params.lift_hold_ticks >= params.com.zmp_offset_ticks;
    if ((small || over) && zmp_offset_m < least_m) {
      least_m = zmp_offset_m;
      best_ticks = ticks;
    }
    if (small) break;
  }
  com.plan(params.com, from, knots_of(best_ticks));
}

}  // namespace polygmap
