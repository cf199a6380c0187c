// SPDX-License-Identifier: Apache-2.0
// The path of the swing foot (eqs 32-33), with what a real staircase asks for: rise before moving forward, keep away
// from the riser, cross the nosing high, come down straight, search the ground at an even speed (swing_timing.hpp:
// faster where it is late).
#pragma once

#include "algorithms/gait/footsteps/footstep_plan.hpp"
#include "algorithms/gait/trajectories/quintic.hpp"

namespace polygmap {

// Times as fractions of the swing.
struct SwingShape {
  double lift_end = 0.46;
  double forward_begin = 0.40;
  double forward_end = 0.84;
  double landing_begin = 0.74;
  // A foot that stops before a riser comes 2 mm too far by its inertia, more on slack drives: it goes the last part on
  // the way down, when it has stopped.
  double short_m = 0.006;
  double short_begin = 0.80;
  double short_end = 0.92;
  double clearance_m = 0.05;
  double retreat_m = 0.015;
  double retreat_end = 0.25;
  double toe_down_rad = 0.0;
  double toe_down_begin = 0.04;
  double toe_down_full = 0.38;
  double toe_up_begin = 0.44;
  double toe_up_end = 0.80;
  double air_roll_rad = 0.1;  // chosen on 14 pushed climbs of the simulation (2026-11-28), and tried on no robot
  double approach_m = 0.008;
  double approach_mps = 0.08;
  double redirect_up = 0.4;
  double redirect_stop = 0.4;

  static void visit(auto& p, auto& field) {
    field("lift_end", p.lift_end, 0.05, 1.0, "The apex is reached at this share of the swing.");
    field("forward_begin", p.forward_begin, 0.0, 0.9, "Horizontal motion begins.");
    field("forward_end", p.forward_end, 0.1, 1.0, "Horizontal motion ends but for the last part.");
    field.ordered("forward_begin", "forward_end");
    field("landing_begin", p.landing_begin, 0.05, 0.99, "The way down begins.");
    field("short_m", p.short_m, -0.05, 0.05,
          "The last part of the way ahead, which the foot goes on the way down: it comes 2 mm too far by its inertia, "
          "up to 4 on slack drives. Negative: it goes too far, and back on the way down.");
    field("short_begin", p.short_begin, 0.0, 0.95, "That last part begins.");
    field("short_end", p.short_end, 0.05, 1.0, "That last part ends.");
    field.ordered("short_begin", "short_end");
    field("clearance_m", p.clearance_m, 0.005, 0.3,
          "Lowest point of the foot at the apex above the higher of start and target.");
    field("retreat_m", p.retreat_m, -0.1, 0.2,
          "The foot goes this far back from the riser ahead while rising; negative: on from the one behind it.");
    field("retreat_end", p.retreat_end, 0.01, 1.0, "The retreat ends.");
    field("toe_down_rad", p.toe_down_rad, 0.0, 1.0,
          "Pitch at the top of the rise: folds the leg without the ankle's limit.");
    field("toe_down_begin", p.toe_down_begin, 0.0, 0.95, "The toe begins to point down.");
    field("toe_down_full", p.toe_down_full, 0.01, 1.0, "The toe points down in full.");
    field.ordered("toe_down_begin", "toe_down_full");
    field("toe_up_begin", p.toe_up_begin, 0.0, 0.95, "The toe begins to come up.");
    field("toe_up_end", p.toe_up_end, 0.05, 1.0, "The toe is level.");
    field.ordered("toe_up_begin", "toe_up_end");
    field("air_roll_rad", p.air_roll_rad, 0.0, 0.5,
          "The sole may roll by this where its ankle's range ends: its leg leans far out after a step aside.");
    field("approach_m", p.approach_m, 0.0, 0.1, "The last part down goes at approach_mps until something is felt.");
    field("approach_mps", p.approach_mps, 0.005, 1.0, "Speed of the last part down.");
    field("redirect_up", p.redirect_up, 0.05, 0.95,
          "A foot that goes to another target is at the apex after this share of the time.");
    field("redirect_stop", p.redirect_stop, 0.0, 1.0,
          "A foot that goes to another target while it rises stops within this share of what it would rise otherwise.");
  }
};

class Swing {
 public:
  // start and target may be tilted a little. duration_ticks: until the target height is reached.
  void plan(const SoleModel& sole, const Transform& start, const SolePose& target, const SwingShape& shape,
            std::int32_t duration_ticks) noexcept;
  // Leaves the path at that tick, reached at that pace (ticks of the path in a tick), for another one to that target:
  // ticks count from 0 again.
  void redirect(double tick, double pace, const SolePose& target, std::int32_t duration_ticks) noexcept;
  // Pose of the sole. After duration_ticks, and before 0 on the way back, the foot goes on downwards at approach_mps:
  // the caller ends it.
  [[nodiscard]] Transform at(double tick) const noexcept;
  [[nodiscard]] double start_height_m() const noexcept { return start_m_.z(); }  // where the foot stood
  [[nodiscard]] std::int32_t duration_ticks() const noexcept { return duration_ticks_; }
  [[nodiscard]] double approach_mps() const noexcept { return shape_.approach_mps; }
  // How far below the target it has been lowered, m; negative before the end.
  [[nodiscard]] double lowered_m(double tick) const noexcept;

 private:
  // Eq. (32) made continuous: height of the lowest point of the foot.
  [[nodiscard]] double height_m(double tick) const noexcept;

  struct Tilt {
    double pitch_rad = 0.0, roll_rad = 0.0;
    [[nodiscard]] static Tilt of(const Mat3& R) noexcept {
      return {math::asin(math::clamp(-R(2, 0), -1.0, 1.0)), math::atan2(R(2, 1), R(2, 2))};
    }
  };
  // Another way: along, across, pitch, roll; up and down again.
  struct Redirected {
    Quintic x, y, pitch, roll, up, down;
    double yaw_rad = 0.0, up_s = 0.0;
  };
  [[nodiscard]] Transform redirected_at(double tick) const noexcept;

  Vec3 start_m_ = Vec3::Zero();
  double start_yaw_rad_ = 0.0;
  Tilt start_tilt_;
  SolePose target_;
  Tilt target_tilt_;
  double turn_rad_ = 0.0;
  double apex_m_ = 0.0;
  SwingShape shape_;
  double toe_m_ = 0.0, foot_height_m_ = 0.0;  // of the collision box
  Quintic landing_;
  double approach_s_ = 0.0;
  std::int32_t duration_ticks_ = 1;
  Redirected other_;
  bool redirected_ = false;
};

}  // namespace polygmap
