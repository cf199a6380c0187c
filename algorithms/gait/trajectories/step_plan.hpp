// SPDX-License-Identifier: Apache-2.0
// One step as a whole: the weight moves over the stance foot, the other foot swings.
#pragma once

#include <array>
#include <span>

#include "algorithms/gait/footsteps/step_goal.hpp"
#include "algorithms/gait/trajectories/com_plan.hpp"
#include "algorithms/gait/trajectories/swing.hpp"
#include "algorithms/gait/trajectories/torso.hpp"

namespace polygmap {

// How long the parts of a step take.
struct StepDurations {
  std::int32_t stair_shift_ticks = 165;
  std::int32_t stair_swing_ticks = 450;
  std::int32_t passing_swing_ticks = 460;
  std::int32_t down_swing_ticks = 600;
  std::int32_t floor_shift_ticks = 350;
  std::int32_t floor_swing_ticks = 350;
  std::int32_t leave_ticks = 30;
  double rise_share = 0.5;
  double passing_rise_share = 0.6;

  static void visit(auto& p, auto& field) {
    field("stair_shift_ticks", p.stair_shift_ticks, 66, 2000, "Double support before a step on the stairs: 0.33 s.");
    field("stair_swing_ticks", p.stair_swing_ticks, 50, 2000, "A swing onto a tread: 0.90 s.");
    field("passing_swing_ticks", p.passing_swing_ticks, 50, 2000, "A swing past a tread: 0.92 s.");
    field("down_swing_ticks", p.down_swing_ticks, 50, 2000, "A swing down onto a tread.");
    field("floor_shift_ticks", p.floor_shift_ticks, 66, 2000, "Double support before a step on the floor.");
    field("floor_swing_ticks", p.floor_swing_ticks, 50, 2000, "A swing on the floor.");
    field("leave_ticks", p.leave_ticks, 0, 200,
          "The rear leg still reaches the ground as long after its foot has left it.");
    field("rise_share", p.rise_share, 0.05, 1.0,
          "The torso rises in this share of a swing onto a tread, to give the foot room.");
    field("passing_rise_share", p.passing_rise_share, 0.05, 1.0,
          "The torso rises in this share of a swing past a tread.");
  }
};
// The rear heel rises before its foot leaves a higher tread: flat, the ankle's range ends above some 0.1 m.
struct HeelRiseParams {
  double flat_m = 0.04;
  double rad_per_m = 3.8;
  double most_rad = 0.65;
  double radps = 3.0;
  std::int32_t ramp_ticks = 40;
  double between_share = 0.68;

  static void visit(auto& p, auto& field) {
    field("flat_m", p.flat_m, 0.0, 0.5, "Down by no more than this the rear sole stays flat until it lifts.");
    field("rad_per_m", p.rad_per_m, 0.0, 20.0, "Beyond that the heel rises by this.");
    field("most_rad", p.most_rad, 0.0, 1.0, "The heel rises no farther.");
    field("radps", p.radps, 0.1, 10.0, "The heel rises no faster.");
    field("ramp_ticks", p.ramp_ticks, 10, 500, "The weight takes as long to there and as long on to the lower foot.");
    field("between_share", p.between_share, 0.0, 1.0,
          "While it rises the zero-moment point is this share of the way on, ahead of the rear toe: its ankle holds 36 "
          "Nm.");
  }
};
// Steps down over a lip.
struct StepDownParams {
  // Ahead first, then down before it, and the last part back.
  SwingShape swing{.lift_end = 0.26,
                   .forward_begin = 0.14,
                   .forward_end = 0.56,
                   .landing_begin = 0.57,
                   .short_m = -0.012,
                   .short_begin = 0.72,
                   .short_end = 0.95,
                   .clearance_m = 0.035,
                   .retreat_m = -0.014,
                   .retreat_end = 0.20};
  double zmp_ahead_m = 0.01;
  double max_leg_m = 0.612;
  // This and most_share were chosen in climbs down 0.15 and 0.17 m, in the simulation alone.
  double lead_margin_rad = 0.06;
  std::int32_t landing_hold_ticks = 100;
  double full_m = 0.13;
  double most_share = 1.35;
  double lean_rad = 0.15;
  double turn_rad = 0.35;
  double com_above_base_m = 0.09;
  double leave_m = 0.008;
  // Both by the legs' kinematics for drops of 0.08 to 0.17 m on treads of 0.28 m, and tried in the simulation alone.
  double rest_margin_rad = 0.1;
  double rest_share = 0.2;
  HeelRiseParams heel_rise;

  static void visit(auto& p, auto& field) {
    field("swing", p.swing);
    field("zmp_ahead_m", p.zmp_ahead_m, -0.05, 0.12,
          "Zero-moment point ahead of the ankle: where the ankles of both legs keep most of their ranges.");
    field("max_leg_m", p.max_leg_m, 0.4, 0.63, "Hip pitch to ankle, of 0.630 stretched.");
    field("lead_margin_rad", p.lead_margin_rad, 0.0, 0.5,
          "The leading step keeps this from the joints' limits: a foot that lands with its ankle at a stop feels the "
          "stop for the ground.");
    field(
        "landing_hold_ticks", p.landing_hold_ticks, 0, 500,
        "The weight sets off so long after the leading foot's landing: a body far ahead of a flat rear foot bends its "
        "ankle.");
    field("full_m", p.full_m, 0.01, 0.5,
          "The torso leans by `lean_rad` and turns by `turn_rad` for this drop, and less for a lower one.");
    field("most_share", p.most_share, 1.0, 2.0,
          "For a higher drop it leans and turns more, up to this many times as much.");
    field("lean_rad", p.lean_rad, 0.0, 0.5,
          "The torso leans ahead by this when the leading foot lands, which keeps the hips back.");
    field("turn_rad", p.turn_rad, 0.0, 0.5, "It turns by this, the hip of the leading foot ahead.");
    field("com_above_base_m", p.com_above_base_m, 0.0, 0.5, "Centre of mass above the base, with legs bent.");
    field("leave_m", p.leave_m, 0.0, 0.05,
          "A foot that walks or leads down goes by this farther ahead as it lifts: a riser that it came down may be "
          "at its "
          "heel.");
    field("rest_margin_rad", p.rest_margin_rad, 0.0, 0.5,
          "At rest between two levels it stands amid its feet where that keeps so much from the joints' ranges.");
    field("rest_share", p.rest_share, 0.0, 0.5,
          "Else it leans, and stands as near to the upper foot: 0 over it, 0.5 amid them.");
    field("heel_rise", p.heel_rise);
  }
};
// Steps up so high that a knee lifts the body with a deep bend.
struct HighStepParams {
  double from_m = 0.1775;
  double torque_share = 0.89;

  static void visit(auto& p, auto& field) {
    field("from_m", p.from_m, 0.0, 1.0,
          "A foot that steps up from this much below the other one leaves a knee that bends deep to lift the body.");
    field("torque_share", p.torque_share, 0.1, 1.0,
          "A plan asks such a knee for at most this share: balance, masses and drives that are off take the rest.");
  }
};
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
  ComPlan::Params com;
  double max_zmp_offset_m = 0.03;
  double zmp_ahead_m = 0.0;
  double zmp_inward_m = 0.022;
  std::int32_t landing_hold_ticks = 50;
  std::int32_t lift_hold_ticks = 15;
  std::int32_t knot_ticks = 15;
  double joint_margin_rad = 0.03;
  double needed_margin_rad = 0.01;
  double knee_min_rad = 0.08;
  double speed_share = 0.95;
  double torque_share = 1.0;
  HighStepParams high;
  StepDownParams down;
  StepDurations durations;

  static void visit(auto& p, auto& field) {
    field("torso", p.torso);
    field("stair_swing", p.stair_swing);
    field("floor_swing", p.floor_swing);
    field("passing_swing", p.passing_swing);
    field("com", p.com);
    field("max_zmp_offset_m", p.max_zmp_offset_m, 0.0, 0.1, "The zero-moment point goes no farther, to set off.");
    field("zmp_ahead_m", p.zmp_ahead_m, -0.05, 0.1,
          "Zero-moment point ahead of the ankle: what it holds ahead and behind is the same.");
    field("zmp_inward_m", p.zmp_inward_m, -0.04, 0.04,
          "Zero-moment point from the sole's middle line towards the other foot.");
    field("landing_hold_ticks", p.landing_hold_ticks, 0, 60,
          "The foot may land this late before the weight sets off for it.");
    field("lift_hold_ticks", p.lift_hold_ticks, 0, 60,
          "The weight is over the stance foot for so long before the other one lifts.");
    field("knot_ticks", p.knot_ticks, 1, 200,
          "Eq. 37: time between two knots; a drive is up to 2 % faster between them than its knots say.");
    field("joint_margin_rad", p.joint_margin_rad, 0.0, 0.3, "A plan keeps this from the joints' ranges.");
    field("needed_margin_rad", p.needed_margin_rad, 0.0, 0.3,
          "The plan of a step without which there is no way on keeps this: the rear foot's after the leading one, and "
          "one that sets a foot beside the other.");
    field("knee_min_rad", p.knee_min_rad, 0.0, 0.5, "A plan keeps the knee this far from the stretched leg.");
    field("speed_share", p.speed_share, 0.1, 1.0, "A plan uses this share of the drives' speed.");
    field("torque_share", p.torque_share, 0.1, 1.0,
          "A plan asks the knee that stands alone for at most this share of its drive's torque: one that has no more "
          "lags and then throws the body up.");
    field("high", p.high);
    field("down", p.down);
    field("durations", p.durations);
  }
};

// What is tried to make a step possible, in this order: the ankles ask for toes that point down, the drives for time,
// and a knee that is to lift the body with a deep bend for a slower rise. Down, the leading ankle asks for legs that
// bend more as it lands, and the one above for a heel that rises sooner; how much of both was chosen in the simulation
// alone.
struct StepTry {
  double toe_down_rad = 0.0;                // half of it on the floor
  double longer = 1.0;                      // the swing
  double rise_longer = 1.0;                 // factor on the torso's rise, which takes a share of the swing
  double leg_shorter_m = 0.0;               // down: by which the legs are shorter than `max_leg_m`
  std::int32_t rear_heel_sooner_ticks = 0;  // down: by which the rear heel begins to rise sooner
};
using StepTries = std::span<const StepTry>;
inline constexpr std::array<StepTry, 8> kStepTries{
    {{0.3}, {0.2}, {0.4}, {0.1}, {0.5}, {0.3, 1.15}, {0.2, 1.15}, {0.4, 1.15}}};
inline constexpr std::array<StepTry, 11> kHighStepTries{
    {{0.3}, {0.2}, {0.4}, {0.1}, {0.5}, {0.3, 1.15}, {0.2, 1.15}, {0.4, 1.15}, {0.3, 1.3}, {0.4, 1.3}, {0.3, 1.45}}};
inline constexpr std::array<StepTry, 8> kPassingTries{
    {{0.4}, {0.5}, {0.3}, {0.6}, {0.2}, {0.4, 1.15}, {0.5, 1.15}, {0.5, 1.15, 1.1}}};
// Down: the foot that leads stays level, the one that follows keeps its heel up until it is over the lip.
inline constexpr std::array<StepTry, 13> kDownTries{{{0.0},
                                                     {0.1},
                                                     {0.2},
                                                     {.leg_shorter_m = 0.004},
                                                     {.leg_shorter_m = 0.008},
                                                     {.longer = 1.25},
                                                     {0.1, 1.25},
                                                     {0.2, 1.25},
                                                     {.longer = 1.25, .leg_shorter_m = 0.004},
                                                     {.longer = 1.25, .leg_shorter_m = 0.008},
                                                     {.longer = 1.25, .leg_shorter_m = 0.014},
                                                     {.longer = 1.5},
                                                     {.longer = 1.5, .leg_shorter_m = 0.014}}};
inline constexpr std::array<StepTry, 11> kDownAfterTries{
    {{0.4},
     {0.3},
     {0.5},
     {0.2},
     {.toe_down_rad = 0.4, .rear_heel_sooner_ticks = 20},
     {.toe_down_rad = 0.4, .longer = 1.25, .rear_heel_sooner_ticks = 20},
     {.toe_down_rad = 0.4, .longer = 1.25, .rear_heel_sooner_ticks = 40},
     {0.4, 1.25},
     {0.3, 1.25},
     {0.5, 1.25},
     {0.6, 1.25}}};

// From where its foot stands it comes down onto a tread.
[[nodiscard]] bool goes_down(const StepGoal& goal, const SolePair& soles) noexcept;
// It leaves a knee that bends deep to lift the body.
[[nodiscard]] bool is_high(const StepParams& params, const StepGoal& goal, const SolePair& soles) noexcept;
[[nodiscard]] StepTries tries_for(const StepParams& params, const StepGoal& goal, const SolePair& soles) noexcept;

// How the zero-moment point goes from one foot to the other.
struct WeightTransfer {
  std::int32_t hold_ticks = 0;        // until it sets off
  std::int32_t to_between_ticks = 0;  // then to between the feet, where it stays; none: straight on
  std::int32_t stay_ticks = 0;
  std::int32_t on_ticks = 1;
  Vec2 between_m = Vec2::Zero();
  [[nodiscard]] std::int32_t ticks() const noexcept { return hold_ticks + to_between_ticks + stay_ticks + on_ticks; }
};

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
  std::int32_t rise_ticks = 1;    // of the swing: the torso has risen
  double joint_margin_rad = 0.0;  // what it is to keep from the joints' ranges
  double torque_share = 1.0;      // what it may ask of what the knee that stands alone has
  double heel_up_rad = 0.0;       // of its foot, when it lifts off
  std::int32_t heel_ticks = 1;    // before which it begins to rise
  WeightTransfer shift, next;     // onto the stance foot, and from it after the landing

  [[nodiscard]] double heel_up_rad_at(std::int32_t tick) const noexcept {
    return heel_up_rad * smooth_window(tick, shift_ticks - heel_ticks, shift_ticks);
  }
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
[[nodiscard]] ZmpKnots zmp_of_swing(const StepPlan& plan) noexcept;
// Sets plan.shift_ticks, not below least_ticks, and plans the centre of mass on from `from`. As plan.shift_ticks was,
// sooner where the weight is on its way already, or later where it stands over the other foot with little room to set
// off: the first that needs a small offset of the zero-moment point.
void plan_shift(const StepParams& params, const HorizontalMotion& from, std::int32_t least_ticks, StepPlan& plan,
                ComPlan& com) noexcept;

}  // namespace polygmap
