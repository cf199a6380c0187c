// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/swing.hpp"

#include <algorithm>

#include "algorithms/core/time.hpp"

namespace polygmap {

void Swing::plan(const SoleModel& sole, const Transform& start, const SolePose& target, const SwingShape& shape,
                 std::int32_t duration_ticks) noexcept {
  redirected_ = false;
  toe_m_ = sole.collision.toe_x_m;
  foot_height_m_ = sole.collision_height_m;
  start_m_ = start.p_m;
  start_yaw_rad_ = yaw_of(start.R);
  start_tilt_ = Tilt::of(start.R);
  target_ = target;
  target_tilt_ = Tilt::of(target.transform().R);
  turn_rad_ = math::wrap_angle(target.yaw_rad - start_yaw_rad_);
  shape_ = shape;
  duration_ticks_ = std::max(duration_ticks, 1);
  apex_m_ = std::max(start.p_m.z(), target.position_m.z()) + shape.clearance_m;
  approach_s_ = shape.approach_m / shape.approach_mps;
  const double landing_s = duration_ticks_ * kTick_s * (1.0 - shape.landing_begin) - approach_s_;
  landing_ = Quintic({apex_m_, 0.0, 0.0}, {target.position_m.z() + shape.approach_m, -shape.approach_mps, 0.0},
                     std::max(landing_s, kTick_s));
}

void Swing::redirect(double tick, double pace, const SolePose& target, std::int32_t duration_ticks) noexcept {
  const Transform now = at(tick), before = at(tick - pace);
  const Vec3 v_mps = (now.p_m - before.p_m) / kTick_s;
  const Tilt tilt = Tilt::of(now.R), tilt_before = Tilt::of(before.R), tilt_after = Tilt::of(target.transform().R);
  const double whole_s = std::max(duration_ticks * kTick_s - approach_s_, 2.0 * kTick_s);
  // Over the nosing of the target's tread, and high enough to stop the rise.
  const double apex_m =
      std::max(target.position_m.z() + shape_.clearance_m,
               now.p_m.z() + std::max(v_mps.z(), 0.0) * shape_.redirect_up * whole_s * shape_.redirect_stop);
  other_.up_s = shape_.redirect_up * whole_s;
  other_.up = Quintic({now.p_m.z(), v_mps.z(), 0.0}, {apex_m, 0.0, 0.0}, other_.up_s);
  other_.down = Quintic({apex_m, 0.0, 0.0}, {target.position_m.z() + shape_.approach_m, -shape_.approach_mps, 0.0},
                        whole_s - other_.up_s);
  other_.x = Quintic({now.p_m.x(), v_mps.x(), 0.0}, {target.position_m.x()}, whole_s);
  other_.y = Quintic({now.p_m.y(), v_mps.y(), 0.0}, {target.position_m.y()}, whole_s);
  other_.pitch = Quintic({tilt.pitch_rad, (tilt.pitch_rad - tilt_before.pitch_rad) / kTick_s, 0.0},
                         {tilt_after.pitch_rad}, whole_s);
  other_.roll =
      Quintic({tilt.roll_rad, (tilt.roll_rad - tilt_before.roll_rad) / kTick_s, 0.0}, {tilt_after.roll_rad}, whole_s);
  other_.yaw_rad = yaw_of(now.R);
  target_ = target;
  duration_ticks_ = std::max(duration_ticks, 1);
  redirected_ = true;
}

Transform Swing::redirected_at(double tick) const noexcept {
  const double t_s = tick * kTick_s, to_end_s = duration_ticks_ * kTick_s - t_s;
  const double turned = smooth_step(tick / duration_ticks_);
  Transform sole;
  sole.p_m = {other_.x.at(t_s).position, other_.y.at(t_s).position, 0.0};
  if (t_s < 0.0) {
    sole.p_m.z() = other_.up.at(0.0).position + t_s * shape_.approach_mps;
  } else if (to_end_s <= approach_s_) {
    sole.p_m.z() = target_.position_m.z() + to_end_s * shape_.approach_mps;
  } else {
    sole.p_m.z() = t_s < other_.up_s ? other_.up.at(t_s).position : other_.down.at(t_s - other_.up_s).position;
  }
  const double yaw_rad = other_.yaw_rad + turned * math::wrap_angle(target_.yaw_rad - other_.yaw_rad);
  sole.R = rotation_zyx(yaw_rad, other_.pitch.at(t_s).position, other_.roll.at(t_s).position);
  return sole;
}

double Swing::height_m(double tick) const noexcept {
  if (tick < 0) return start_m_.z() + tick * kTick_s * shape_.approach_mps;
  const double u = tick / duration_ticks_;
  if (u <= shape_.landing_begin) {
    return start_m_.z() + (apex_m_ - start_m_.z()) * smooth_window(u, 0.0, shape_.lift_end);
  }
  const double to_end_s = (duration_ticks_ - tick) * kTick_s;
  if (to_end_s <= approach_s_) return target_.position_m.z() + to_end_s * shape_.approach_mps;
  return landing_.at((u - shape_.landing_begin) * duration_ticks_ * kTick_s).position;
}

double Swing::lowered_m(double tick) const noexcept { return (tick - duration_ticks_) * kTick_s * shape_.approach_mps; }

// Eq. (32): lift to the apex, down to the landing height z_0. As printed the curve jumps by z_0 at the apex and starts
// at full speed; here both halves start and end smoothly. Eq. (33): start to end in a share of the time; the printed
// constant speed would meet the riser, so the motion waits for the rise and ends before the landing.
Transform Swing::at(double tick) const noexcept {
  if (redirected_) return redirected_at(tick);
  const SwingShape& s = shape_;
  const double u = tick / duration_ticks_;
  const double forward = smooth_window(u, s.forward_begin, s.forward_end);
  const double retreat_m = s.retreat_m * smooth_window(u, 0.0, s.retreat_end) * (1.0 - forward);
  const double short_m = s.short_m * smooth_window(u, s.forward_begin, s.forward_end) *
                         (1.0 - smooth_window(u, s.short_begin, s.short_end));
  const double toe_down_rad = s.toe_down_rad * smooth_window(u, s.toe_down_begin, s.toe_down_full) *
                              (1.0 - smooth_window(u, s.toe_up_begin, s.toe_up_end));
  const double yaw_rad = start_yaw_rad_ + turn_rad_ * forward;

  // Pitched, the lowest point is the toe's edge and the foremost one the upper front edge of the collision box: these
  // two follow the planned path.
  const math::SinCos toe = math::sin_cos(toe_down_rad), turn = math::sin_cos(yaw_rad);
  const double lift_m = toe_m_ * toe.sin;
  const double lean_m = toe_m_ * (toe.cos - 1.0) + foot_height_m_ * toe.sin;

  Transform sole;
  const Vec3 heading{turn.cos, turn.sin, 0.0};
  sole.p_m = start_m_ + (target_.position_m - start_m_) * forward - (retreat_m + short_m + lean_m) * heading;
  sole.p_m.z() = height_m(tick) + lift_m;
  // The start's small tilt fades, and the target's comes as the toe does.
  const double left = 1.0 - smooth_window(u, 0.0, s.forward_end), came = smooth_window(u, s.toe_up_begin, s.toe_up_end);
  sole.R = rotation_zyx(yaw_rad, toe_down_rad + start_tilt_.pitch_rad * left + target_tilt_.pitch_rad * came,
                        start_tilt_.roll_rad * left + target_tilt_.roll_rad * came);
  return sole;
}

}  // namespace polygmap
