// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/torso.hpp"

#include <algorithm>

#include "algorithms/core/time.hpp"

namespace polygmap {

double reach_height_m(const LegGeometry& g, const TorsoPose& base, Foot leg, const SolePose& sole,
                      double max_leg_m) noexcept {
  // The leg bends in a plane through the hip's roll axis: its forward reach and the distance from that axis add up to
  // the leg, the axis being |hip_p_hip_pitch.z| above the pitch joint.
  // A base that leans takes the hips back, which hang below it.
  const double back_m = math::sin(base.lean_rad) * -(g.base_p_hip_m.z() + g.hip_p_hip_pitch_m.z());
  const Vec3 hip_m{g.base_p_hip_m.x() + g.hip_p_hip_pitch_m.x() - back_m,
                   side_sign(leg) * (g.base_p_hip_m.y() + g.hip_p_hip_pitch_m.y()), 0.0};
  const Vec3 d = rotation_z(base.yaw_rad).transpose() * (sole.position_m - base.position_m) - hip_m;
  const double in_plane_m =
      math::sqrt(std::max(math::square(max_leg_m) - math::square(d.x()), 0.0)) - g.hip_p_hip_pitch_m.z();
  const double drop_m = math::sqrt(std::max(math::square(in_plane_m) - math::square(d.y()), 0.0));
  return sole.position_m.z() + g.ankle_to_sole_m + drop_m - g.base_p_hip_m.z();
}

namespace {

double allowed_height_m(const LegGeometry& geometry, const TorsoParams& params, const SolePair& soles,
                        const TorsoPose& torso) noexcept {
  double z_m = std::max(soles[0].position_m.z(), soles[1].position_m.z()) + params.height_m;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    z_m = std::min(z_m, reach_height_m(geometry, torso, leg, soles[index_of(leg)], params.max_leg_m));
  }
  return z_m;
}

}  // namespace

TorsoPose torso_at(const LegGeometry& geometry, const TorsoParams& params, const SolePair& soles, const Vec2& base_m,
                   double turn_rad, double lean_rad) noexcept {
  TorsoPose torso{{base_m.x(), base_m.y(), 0.0}, middle_of(soles).yaw_rad + turn_rad, lean_rad};
  torso.position_m.z() = allowed_height_m(geometry, params, soles, torso);
  return torso;
}

TorsoPose torso_over(const LegGeometry& geometry, const TorsoParams& params, Foot stance,
                     const SolePair& soles) noexcept {
  const SolePose& foot = soles[index_of(stance)];
  const Vec3 local_m{params.ahead_m, -side_sign(stance) * params.inward_m, 0.0};
  return torso_at(geometry, params, soles, (foot.position_m + rotation_z(foot.yaw_rad) * local_m).head<2>());
}

TorsoPose torso_between(const LegGeometry& geometry, const TorsoParams& params, const SolePair& soles) noexcept {
  TorsoPose torso = middle_of(soles);
  torso.position_m.z() = allowed_height_m(geometry, params, soles, torso);
  return torso;
}

std::int32_t lowering_ticks(const TorsoParams& params, double drop_m) noexcept {
  constexpr double kQuintic = 5.78;  // greatest acceleration between two rests, of distance over time squared
  const double least_s = math::sqrt(kQuintic * std::max(drop_m, 0.0) / params.max_lowering_mps2);
  return std::max(static_cast<std::int32_t>(least_s / kTick_s), params.min_lowering_ticks);
}

TorsoTrajectory::State TorsoTrajectory::at_rest(const Transform& base) noexcept {
  const double pitch_rad = math::asin(math::clamp(-base.R(2, 0), -1.0, 1.0));
  const double roll_rad = math::atan2(base.R(2, 1), base.R(2, 2));
  return {Motion{base.p_m.x()}, {base.p_m.y()}, {base.p_m.z()}, {roll_rad}, {pitch_rad}, {yaw_of(base.R)}};
}

Transform TorsoTrajectory::pose(const State& s) noexcept {
  return {rotation_zyx(s[5].position, s[4].position, s[3].position), Vec3{s[0].position, s[1].position, s[2].position}};
}

TorsoTrajectory::State TorsoTrajectory::placed(const State& state, const Transform& base, const Vec2& com_m) noexcept {
  State result = at_rest(base);
  result[0].position = com_m.x();
  result[1].position = com_m.y();
  for (std::size_t i = 0; i < kAxes; ++i) {
    result[i].speed = state[i].speed;
    result[i].acceleration = state[i].acceleration;
  }
  return result;
}

HorizontalMotion TorsoTrajectory::horizontal(const State& state) noexcept {
  return {{state[0].position, state[1].position},
          {state[0].speed, state[1].speed},
          {state[0].acceleration, state[1].acceleration}};
}

void TorsoTrajectory::set_horizontal(State& state, const HorizontalMotion& motion) noexcept {
  for (int a = 0; a < 2; ++a) {
    state[static_cast<std::size_t>(a)] = {motion.position_m[a], motion.velocity_mps[a], motion.acceleration_mps2[a]};
  }
}

void TorsoTrajectory::plan(const State& from, const TorsoPose& to, std::int32_t duration_ticks,
                           std::int32_t height_ticks) noexcept {
  const std::array<double, kAxes - 2> goal{to.position_m.z(), 0.0, to.lean_rad,
                                           from[5].position + math::wrap_angle(to.yaw_rad - from[5].position)};
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const std::int32_t ticks = std::max(i == 0 ? height_ticks : duration_ticks, 1);
    axes_[i] = Quintic(from[i + 2], {goal[i]}, ticks * kTick_s);
  }
}

TorsoTrajectory::State TorsoTrajectory::at(std::int32_t tick, const HorizontalMotion& horizontal) const noexcept {
  State s;
  set_horizontal(s, horizontal);
  for (std::size_t i = 0; i < axes_.size(); ++i) s[i + 2] = axes_[i].at(tick * kTick_s);
  return s;
}

}  // namespace polygmap
