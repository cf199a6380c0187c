// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/footstep_plan.hpp"

namespace polygmap {

SolePose foot_of_torso(const TorsoPose& torso, Foot foot, double half_width_m, double height_m) noexcept {
  const Vec3 b_f{0.0, side_sign(foot) * half_width_m, -height_m};
  return {torso.position_m + rotation_z(torso.yaw_rad) * b_f, torso.yaw_rad};
}

TorsoPose torso_of_foot(const SolePose& sole, Foot foot, double half_width_m, double height_m) noexcept {
  const Vec3 b_f{0.0, side_sign(foot) * half_width_m, -height_m};
  return {sole.position_m - rotation_z(sole.yaw_rad) * b_f, sole.yaw_rad};
}

SolePose sole_beside(const SolePose& stance, Foot foot, double half_width_m) noexcept {
  return foot_of_torso(torso_of_foot(stance, other(foot), half_width_m, 0.0), foot, half_width_m, 0.0);
}

SolePose sole_beside_on_tread(const SolePose& stance, Foot foot, const SolePose& foothold,
                              double half_width_m) noexcept {
  const Vec3 across = side_sign(foot) * rotation_z(foothold.yaw_rad).col(1);
  SolePose beside = foothold;
  beside.position_m += (2.0 * half_width_m - across.dot(foothold.position_m - stance.position_m)) * across;
  beside.position_m.z() = stance.position_m.z();
  return beside;
}

TorsoPose middle_of(const SolePair& soles) noexcept {
  const double turn_rad = math::wrap_angle(soles[1].yaw_rad - soles[0].yaw_rad);
  return {0.5 * (soles[0].position_m + soles[1].position_m), math::wrap_angle(soles[0].yaw_rad + 0.5 * turn_rad)};
}

TorsoDisplacement displacement(const TorsoPose& previous, const TorsoPose& next) noexcept {
  return {rotation_z(previous.yaw_rad).transpose() * (next.position_m - previous.position_m),
          math::wrap_angle(next.yaw_rad - previous.yaw_rad)};
}

Foot swing_foot(const TorsoDisplacement& step, Foot by_gait_state, const SwingRule& rule) noexcept {
  if (std::abs(step.local_m.y()) > rule.lateral_dead_band_m) {
    return step.local_m.y() > 0.0 ? Foot::kLeft : Foot::kRight;
  }
  if (std::abs(step.turn_rad) > rule.turn_dead_band_rad) return step.turn_rad > 0.0 ? Foot::kLeft : Foot::kRight;
  return by_gait_state;
}

OrientedRectangle foot_rectangle(const SoleRectangle& collision, const SolePose& sole, double margin_m) noexcept {
  const Vec2 heading{math::cos(sole.yaw_rad), math::sin(sole.yaw_rad)};
  return {sole.position_m.head<2>() + collision.centre_x_m() * heading, 0.5 * collision.length_m() + margin_m,
          collision.half_width_m + margin_m, sole.yaw_rad};
}

SolePose floor_step(const SoleRectangle& collision, const SolePose& stance, Foot swing, const TorsoPose& goal,
                    double half_width_m, const FloorStepLimits& limits) noexcept {
  const TorsoPose previous = torso_of_foot(stance, other(swing), half_width_m, 0.0);
  const TorsoDisplacement wanted = displacement(previous, goal);
  const double turn_rad = math::clamp(wanted.turn_rad, -limits.turn_rad, limits.turn_rad);
  const double forward_m = math::clamp(wanted.local_m.x(), -limits.backward_m, limits.forward_m);
  double lateral_m = math::clamp(wanted.local_m.y(), -limits.lateral_m, limits.lateral_m);

  constexpr int kTries = 12;  // which bound the time
  const OrientedRectangle ground_of_stance = foot_rectangle(collision, stance, limits.overlap_margin_m);
  SolePose foot;
  for (int i = 0; i < kTries; ++i) {
    const Vec3 local_m{forward_m, lateral_m, 0.0};
    const TorsoPose next{previous.position_m + rotation_z(previous.yaw_rad) * local_m,
                         math::wrap_angle(previous.yaw_rad + turn_rad)};
    foot = foot_of_torso(next, swing, half_width_m, 0.0);
    if (!overlap(foot_rectangle(collision, foot, limits.overlap_margin_m), ground_of_stance)) break;
    lateral_m += side_sign(swing) * limits.outwards_m;
  }
  foot.position_m.z() = stance.position_m.z();
  return foot;
}

}  // namespace polygmap
