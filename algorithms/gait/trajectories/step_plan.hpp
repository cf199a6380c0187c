// SPDX-License-Identifier: Apache-2.0
// One step as a whole: the weight moves over the stance foot, the other foot swings.
#pragma once

#include <array>

#include "algorithms/gait/footsteps/step_goal.hpp"
#include "algorithms/gait/trajectories/com_plan.hpp"
#include "algorithms/gait/trajectories/swing.hpp"
#include "algorithms/gait/trajectories/torso.hpp"

namespace polygmap {

struct StepParams {
  TorsoParams torso;
  SwingShape stair_swing;
  SwingShape floor_swing{.lift_end = 0.40,
                         .forward_begin = 0.12,
                         .forward_end = 0.80,
                         .landing_begin = 0.55,
                         .short_m = 0.0,
                         .clearance_m = 0.05,
                         .retreat_m = 0.0};
  // Two rises up and past the nosing of the tread that the other foot stands on.
  SwingShape passing_swing{.lift_end = 0.67,
                           .forward_begin = 0.16,
                           .forward_end = 0.88,
                           .landing_begin = 0.74,
                           .clearance_m = 0.045,
                           .retreat_m = 0.02,
                           .retreat_end = 0.25,
                           .toe_down_begin = 0.01,
                           .toe_down_full = 0.29,
                           .toe_up_begin = 0.30,
                           .toe_up_end = 0.70};
  std::int32_t stair_shift_ticks = 165;    // 0.33 s of double support
  std::int32_t stair_swing_ticks = 450;    // 0.90 s
  std::int32_t passing_swing_ticks = 460;  // 0.92 s
  std::int32_t floor_shift_ticks = 350;
  std::int32_t floor_swing_ticks = 350;
  ComPlan::Params com;
  double max_zmp_offset_m = 0.03;        // of the zero-moment point, to set off
  double zmp_ahead_m = 0.0;              // of the ankle: what it holds ahead and behind is the same
  double zmp_inward_m = 0.022;           // and towards the other foot
  std::int32_t landing_hold_ticks = 50;  // the foot may land that much late before the weight sets off for it
  std::int32_t lift_hold_ticks = 15;     // and the weight is over the stance foot that long before the other one lifts
  std::int32_t leave_ticks = 30;         // the rear leg still reaches the ground so long after its foot has left it
  double rise_share = 0.5;               // of a swing onto a tread in which the torso rises, to give the foot room
  double passing_rise_share = 0.6;
  std::int32_t knot_ticks = 15;    // eq. (37): 30 ms; between them a drive is up to 2 % faster than its knots say
  double joint_margin_rad = 0.03;  // what a plan keeps from the joints' ranges
  double knee_min_rad = 0.08;      // and from the stretched leg
  double speed_share = 0.95;       // of the drives' speed that a plan may use
};

// What is tried to make a step possible, in this order: the ankles ask for toes that point down, the drives for time.
struct StepTry {
  double toe_down_rad = 0.0;  // half of it on the floor
  double longer = 1.0;        // the swing
};
inline constexpr std::size_t kStepTryCount = 7;
using StepTries = std::array<StepTry, kStepTryCount>;
inline constexpr StepTries kStepTries{{{0.3}, {0.2}, {0.4}, {0.1}, {0.5}, {0.3, 1.15}, {0.2, 1.15}}};
inline constexpr StepTries kPassingTries{{{0.4}, {0.5}, {0.3}, {0.6}, {0.2}, {0.4, 1.15}, {0.5, 1.15}}};

struct StepPlan {
  StepGoal goal;
  TorsoPose lift_off;
  TorsoPose touch_down;
  Vec2 zmp_stance_m = Vec2::Zero();  // while the foot swings
  Vec2 zmp_next_m = Vec2::Zero();    // then
  StepTry tried;
  SwingShape shape;
  std::int32_t shift_ticks = 1;
  std::int32_t swing_ticks = 1;
  std::int32_t rise_ticks = 1;  // of the swing: the torso has risen
};

// All but the torso.
[[nodiscard]] StepPlan plan_step(const StepParams& params, const StepGoal& goal, const SolePair& soles,
                                 const StepTry& tried) noexcept;
// The torso as high as both legs reach from where the centre of mass is a little after the foot leaves, which rises
// slowly at first, and when it lands: on the way to the stance foot it is still behind it, which spares the front leg
// its bend.
void plan_torso(const LegGeometry& geometry, const StepParams& params, const SolePair& soles, const ComPlan& com,
                std::int32_t lift_off_tick, StepPlan& plan) noexcept;

// Zero-moment points of a step whose shift begins with one at start_m, and from its lift-off on.
[[nodiscard]] ZmpKnots zmp_of_shift(const StepParams& params, const StepPlan& plan, const Vec2& start_m) noexcept;
[[nodiscard]] ZmpKnots zmp_of_swing(const StepParams& params, const StepPlan& plan) noexcept;
// Sets plan.shift_ticks, not below least_ticks, and plans the centre of mass on from `from`. As plan.shift_ticks was,
// sooner where the weight is on its way already, or later where it stands over the other foot with little room to set
// off: the first that needs a small offset of the zero-moment point.
void plan_shift(const StepParams& params, const HorizontalMotion& from, std::int32_t least_ticks, StepPlan& plan,
                ComPlan& com) noexcept;

}  // namespace polygmap
