// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/between_feet.hpp"

#include <algorithm>

namespace polygmap {

void BetweenFeet::settle(const GaitInput& in, GaitShared& gait, double height_m) noexcept {
  const StepParams& step = gait.params.step;
  const std::int32_t settle_ticks = gait.params.standing.settle_ticks;
  BodyPlan& plan = gait.plan;
  const SolePair soles = plan.soles();
  TorsoParams torso = step.torso;
  torso.height_m = height_m;
  const TorsoPose middle = torso_between(gait.robot.legs, torso, soles);
  // The base is still elsewhere: rising at once would take the ground from the leg that it is far from.
  const TorsoPose here = torso_at(gait.robot.legs, torso, soles, plan.plan_T_base().p_m.head<2>());
  TorsoPose rest = middle;
  rest.position_m.z() = std::min(middle.position_m.z(), here.position_m.z());
  crouch_.begin(in, gait, rest);
  const double drop_m = plan.height_m() - crouch_.torso().position_m.z();
  const bool soon = crouch_.crouches() && drop_m > 0.0;
  const std::int32_t height_ticks = soon ? lowering_ticks(step.torso, drop_m) : settle_ticks;
  plan.move_torso(crouch_.torso(), settle_ticks, height_ticks);
  const Vec3 ahead_m = rotation_z(middle.yaw_rad) * Vec3{step.zmp_ahead_m, 0, 0};
  plan.rest_over(step.com, (middle.position_m + ahead_m).head<2>());
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
  const double height_m = torso_between(gait.robot.legs, gait.params.step.torso, gait.plan.soles()).position_m.z();
  if (height_m < crouch_.upright_height_m() + gait.params.crouch.step_m) return;
  crouch_.set_upright_height_m(height_m);
  gait.plan.move_torso(crouch_.torso(), settle_ticks, settle_ticks);
}

}  // namespace polygmap
