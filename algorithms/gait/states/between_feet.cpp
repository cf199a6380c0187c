// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/between_feet.hpp"

#include <algorithm>

#include "algorithms/geometry/line.hpp"

namespace polygmap {
namespace {

// Least of both legs to the ends of their joints' ranges.
double legs_margin_rad(const RobotModel& robot, const TorsoPose& base, const SolePair& soles) noexcept {
  const Transform odom_T_base{rotation_zyx(base.yaw_rad, base.lean_rad, 0.0), base.position_m};
  const Transform base_T_odom = odom_T_base.inverse();
  const auto of = [&](Foot leg) {
    return limit_margin_rad(robot.drives, leg,
                            solve_leg(robot.legs, leg, base_T_odom * soles[index_of(leg)].transform()).q_rad);
  };
  return std::min(of(Foot::kLeft), of(Foot::kRight));
}

}  // namespace

BetweenFeet::Rest BetweenFeet::rest(const GaitShared& gait, const TorsoParams& torso) const noexcept {
  const StepDownParams& down = gait.params.step.down;
  const SolePair soles{sole_pose(gait.plan.flat_sole(gait.robot.sole, Foot::kLeft)),
                       sole_pose(gait.plan.flat_sole(gait.robot.sole, Foot::kRight))};
  const TorsoPose middle = torso_between(gait.robot.legs, torso, soles);
  if (legs_margin_rad(gait.robot, middle, soles) >= down.rest_margin_rad) return {middle, middle.position_m.head<2>()};
  // With the other foot on a lower tread ahead, the upper one's ankle bends less where the body leans and is near it.
  const std::size_t upper = soles[0].position_m.z() > soles[1].position_m.z() ? 0 : 1;
  const Vec2 upper_m = soles[upper].position_m.head<2>(), lower_m = soles[1 - upper].position_m.head<2>();
  const Vec2 com_m = upper_m + down.rest_share * (lower_m - upper_m);
  const Vec2 base_m = com_m - down.com_above_base_m * math::sin(down.lean_rad) * unit_at(middle.yaw_rad);
  return {torso_at(gait.robot.legs, torso, soles, base_m, 0.0, down.lean_rad), com_m};
}

void BetweenFeet::settle(const GaitInput& in, GaitShared& gait, double height_m) noexcept {
  const StepParams& step = gait.params.step;
  const std::int32_t settle_ticks = gait.params.standing.settle_ticks;
  BodyPlan& plan = gait.plan;
  const SolePair soles = plan.soles();
  TorsoParams torso = step.torso;
  torso.height_m = height_m;
  const Rest at = rest(gait, torso);
  // The base is still elsewhere: rising at once would take the ground from the leg that it is far from.
  const TorsoPose here = torso_at(gait.robot.legs, torso, soles, plan.plan_T_base().p_m.head<2>());
  TorsoPose low = at.base;
  low.position_m.z() = std::min(low.position_m.z(), here.position_m.z());
  crouch_.begin(in, gait, low);
  const double drop_m = plan.height_m() - crouch_.torso().position_m.z();
  const bool soon = crouch_.crouches() && drop_m > 0.0;
  const std::int32_t height_ticks = soon ? lowering_ticks(step.torso, drop_m) : settle_ticks;
  plan.move_torso(crouch_.torso(), settle_ticks, height_ticks);
  plan.rest_over(step.com, at.com_m + step.zmp_ahead_m * unit_at(at.base.yaw_rad));
  tick_ = 0;
}

void BetweenFeet::follow(const GaitInput& in, GaitShared& gait) noexcept {
  if (in.held) return;
  const std::int32_t settle_ticks = gait.params.standing.settle_ticks;
  if (tick_ == settle_ticks) rise(gait);
  crouch_.update(in, gait, settle_ticks - tick_);
  tick_ = next_tick(tick_);
}

// Settled, the legs reach higher than on the way there: between two levels by centimetres.
void BetweenFeet::rise(GaitShared& gait) noexcept {
  const std::int32_t settle_ticks = gait.params.standing.settle_ticks;
  const double height_m = rest(gait, gait.params.step.torso).base.position_m.z();
  if (height_m < crouch_.upright_height_m() + gait.params.crouch.step_m) return;
  crouch_.set_upright_height_m(height_m);
  gait.plan.move_torso(crouch_.torso(), settle_ticks, settle_ticks);
}

}  // namespace polygmap
