// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/step_plan.hpp"

#include <algorithm>

#include "algorithms/core/time.hpp"
#include "algorithms/geometry/line.hpp"

namespace polygmap {

namespace {

// In which the weight goes from one foot to the other.
std::int32_t zmp_ramp_ticks(const StepParams& params) noexcept {
  return params.durations.stair_shift_ticks - params.landing_hold_ticks - params.lift_hold_ticks;
}

// Where a foot carries all.
Vec2 zmp_in(const StepParams& params, const SolePose& sole, Foot foot, bool down) noexcept {
  const Vec3 local_m{down ? params.down.zmp_ahead_m : params.zmp_ahead_m, -side_sign(foot) * params.zmp_inward_m, 0.0};
  return (sole.position_m + rotation_z(sole.yaw_rad) * local_m).head<2>();
}

// A plan keeps this margin to the joints' limits.
double joint_margin_rad(const StepParams& params, StepKind kind, bool down) noexcept {
  if (kind == StepKind::kClosing || kind == StepKind::kTrailing) return params.needed_margin_rad;
  return down && leads(kind) ? params.down.lead_margin_rad : params.joint_margin_rad;
}

// Down: the weight waits between the toe's edge of the upper foot and the other one while the upper heel rises, which
// may begin while the weight is on its way there.
void plan_heel_rise(const StepParams& params, const SolePair& soles, StepPlan& plan) noexcept {
  constexpr double kQuintic = 1.875;  // greatest speed between two rests, of way over time
  const StepDownParams& down = params.down;
  const HeelRiseParams& heel = down.heel_rise;
  const StepGoal& goal = plan.goal;
  const bool is_leading = leads(goal.kind);
  const Foot upper = is_leading ? other(goal.foot) : goal.foot;
  const double drop_m = soles[index_of(upper)].position_m.z() - goal.target.position_m.z();
  const double heel_up_rad = math::clamp(heel.rad_per_m * (drop_m - heel.flat_m), 0.0, heel.most_rad);
  const auto heel_ticks = static_cast<std::int32_t>(kQuintic * heel_up_rad / heel.radps / kTick_s);
  WeightTransfer& transfer = is_leading ? plan.next : plan.shift;
  transfer.hold_ticks = down.landing_hold_ticks;
  if (heel_up_rad > 0.0) {
    transfer.to_between_ticks = transfer.on_ticks = heel.ramp_ticks;
    transfer.stay_ticks = std::max(heel_ticks - heel.ramp_ticks - params.lift_hold_ticks, 1);
    const Vec2 from_m = is_leading ? plan.zmp_stance_m : zmp_in(params, soles[index_of(upper)], upper, true);
    const Vec2 to_m = is_leading ? plan.zmp_next_m : plan.zmp_stance_m;
    transfer.between_m = from_m + heel.between_share * (to_m - from_m);
  }
  if (is_leading) return;
  plan.heel_up_rad = heel_up_rad;
  plan.heel_ticks =
      transfer.stay_ticks + transfer.on_ticks + params.lift_hold_ticks + plan.tried.rear_heel_sooner_ticks;
  plan.shift_ticks = transfer.ticks() + params.lift_hold_ticks;
}

}  // namespace

bool goes_down(const StepGoal& goal, const SolePair& soles) noexcept {
  constexpr double kLeastDrop_m = 0.015;
  return onto_tread(goal.kind) && goal.target.position_m.z() < soles[index_of(goal.foot)].position_m.z() - kLeastDrop_m;
}

bool is_high(const StepParams& params, const StepGoal& goal, const SolePair& soles) noexcept {
  const std::size_t foot = index_of(goal.foot), stance = index_of(other(goal.foot));
  return soles[stance].position_m.z() - soles[foot].position_m.z() > params.high.from_m;
}

StepTries tries_for(const StepParams& params, const StepGoal& goal, const SolePair& soles) noexcept {
  if (goal.kind == StepKind::kPassing) return kPassingTries;
  if (goes_down(goal, soles)) return leads(goal.kind) ? StepTries(kDownTries) : StepTries(kDownAfterTries);
  return is_high(params, goal, soles) ? StepTries(kHighStepTries) : StepTries(kStepTries);
}

StepPlan plan_step(const StepParams& params, const StepGoal& goal, const SolePair& soles,
                   const StepTry& tried) noexcept {
  const bool on_floor = on_level(goal.kind), passing = goal.kind == StepKind::kPassing, down = goes_down(goal, soles);
  const Foot stance = other(goal.foot);
  SolePair landed = soles;
  landed[index_of(goal.foot)] = goal.target;

  StepPlan plan;
  plan.goal = goal;
  plan.shape = on_floor  ? params.floor_swing
               : down    ? params.down.swing
               : passing ? params.passing_swing
                         : params.stair_swing;
  const SolePose& from = soles[index_of(goal.foot)];
  const Vec2 way_m = (goal.target.position_m - from.position_m).head<2>();
  const bool walks_on = goal.kind == StepKind::kFloor && unit_at(from.yaw_rad).dot(way_m) > params.down.leave_m;
  if (walks_on || (down && leads(goal.kind))) {
    plan.shape.retreat_m -= params.down.leave_m;
  }
  plan.shift_ticks = on_floor ? params.durations.floor_shift_ticks : params.durations.stair_shift_ticks;
  const std::int32_t usual_ticks = on_floor  ? params.durations.floor_swing_ticks
                                   : down    ? params.durations.down_swing_ticks
                                   : passing ? params.durations.passing_swing_ticks
                                             : params.durations.stair_swing_ticks;
  plan.swing_ticks = static_cast<std::int32_t>(tried.longer * usual_ticks);
  const double rise_share = on_floor || down ? 1.0
                            : passing        ? params.durations.passing_rise_share
                                             : params.durations.rise_share;
  plan.rise_ticks = static_cast<std::int32_t>(std::min(tried.rise_longer * rise_share, 1.0) * plan.swing_ticks);
  plan.tried = tried;
  plan.joint_margin_rad = joint_margin_rad(params, goal.kind, down);
  plan.torque_share =
      is_high(params, goal, soles) ? std::min(params.high.torque_share, params.torque_share) : params.torque_share;
  plan.shape.toe_down_rad = on_floor ? 0.5 * tried.toe_down_rad : tried.toe_down_rad;
  plan.zmp_stance_m = zmp_in(params, landed[index_of(stance)], stance, down);
  // After a step that leads the weight goes on to that foot; after the others it may have to stop anywhere.
  plan.zmp_next_m = zmp_in(params, goal.target, goal.foot, down);
  if (!leads(goal.kind)) plan.zmp_next_m = 0.5 * (plan.zmp_next_m + plan.zmp_stance_m);
  plan.shift = plan.next = {params.landing_hold_ticks, 0, 0, zmp_ramp_ticks(params), Vec2::Zero()};
  if (down) plan_heel_rise(params, soles, plan);
  return plan;
}

void plan_torso(const LegGeometry& geometry, const StepParams& params, const SolePair& soles, const ComPlan& com,
                std::int32_t lift_off_tick, StepPlan& plan) noexcept {
  SolePair landed = soles;
  landed[index_of(plan.goal.foot)] = plan.goal.target;
  TorsoParams torso = params.torso;
  double turn_rad = 0.0, lean_rad = 0.0;  // in a split stance down
  if (goes_down(plan.goal, soles)) {
    torso.max_leg_m = params.down.max_leg_m - plan.tried.leg_shorter_m;
    const double share = math::clamp(std::abs(landed[0].position_m.z() - soles[0].position_m.z() +
                                              landed[1].position_m.z() - soles[1].position_m.z()) /
                                         params.down.full_m,
                                     0.0, params.down.most_share);
    lean_rad = share * params.down.lean_rad;
    turn_rad = share * params.down.turn_rad * (leads(plan.goal.kind) ? -1.0 : 1.0) * side_sign(plan.goal.foot);
  }
  const auto torso_when = [&](std::int32_t tick, const SolePair& stand, bool is_split) {
    const double lean = is_split ? lean_rad : 0.0;
    // The centre of mass is above the base, and ahead of one that leans.
    const Vec2 base_m =
        com.at(tick).position_m - lean * params.down.com_above_base_m * unit_at(middle_of(stand).yaw_rad);
    return torso_at(geometry, torso, stand, base_m, is_split ? turn_rad : 0.0, lean);
  };
  plan.lift_off = torso_when(lift_off_tick + params.durations.leave_ticks, soles, !leads(plan.goal.kind));
  plan.touch_down = torso_when(lift_off_tick + plan.swing_ticks, landed, leads(plan.goal.kind));
  if (!leads(plan.goal.kind)) return;
  // Rising with the foot gives the leading leg room to fold, at a lower knee speed.
  const double tall_m = soles[index_of(other(plan.goal.foot))].position_m.z() + params.torso.lead_height_m;
  plan.touch_down.position_m.z() = std::min(plan.touch_down.position_m.z(), tall_m);
}

ZmpKnots zmp_of_swing(const StepPlan& plan) noexcept {
  const WeightTransfer& next = plan.next;
  ZmpKnots knots;
  std::int32_t tick = plan.swing_ticks + next.hold_ticks;
  (void)knots.try_push_back({tick, plan.zmp_stance_m});
  if (next.stay_ticks > 0) {
    (void)knots.try_push_back({tick += next.to_between_ticks, next.between_m});
    (void)knots.try_push_back({tick += next.stay_ticks, next.between_m});
  }
  (void)knots.try_push_back({tick + std::max(next.on_ticks, 1), plan.zmp_next_m});
  return knots;
}

ZmpKnots zmp_of_shift(const StepParams& params, const StepPlan& plan, const Vec2& start_m) noexcept {
  const WeightTransfer& shift = plan.shift;
  ZmpKnots knots;
  const std::int32_t over = std::max(plan.shift_ticks - params.lift_hold_ticks, 2);
  const std::int32_t leave = over - shift.on_ticks, arrive = leave - shift.stay_ticks;
  (void)knots.try_push_back({std::max(arrive - shift.to_between_ticks, over / 5), start_m});
  if (shift.stay_ticks > 0) {
    (void)knots.try_push_back({std::max(arrive, over / 5 + 1), shift.between_m});
    (void)knots.try_push_back({std::max(leave, over / 5 + 2), shift.between_m});
  }
  (void)knots.try_push_back({over, plan.zmp_stance_m});
  for (const ZmpKnot& knot : zmp_of_swing(plan)) {
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
