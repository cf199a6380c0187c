// SPDX-License-Identifier: Apache-2.0
// One step as a whole: the weight moves over the stance foot, the other foot swings. Knots of it (eqs 30, 37), the
// proof that the legs can follow, and the search for a swing shape that they can.
#pragma once

#include <array>

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/gait/trajectories/com_plan.hpp"
#include "algorithms/gait/trajectories/swing.hpp"
#include "algorithms/gait/trajectories/torso.hpp"
#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

enum class StepKind : std::uint8_t {
  kFloor,     // while walking up
  kLeading,   // the first foot onto the next tread
  kTrailing,  // the second, beside it
  kPassing,   // or past it onto the tread beyond
};
[[nodiscard]] constexpr bool onto_tread(StepKind kind) noexcept { return kind != StepKind::kFloor; }
// It lands higher than the other foot stands, and the weight goes on to it.
[[nodiscard]] constexpr bool leads(StepKind kind) noexcept {
  return kind == StepKind::kLeading || kind == StepKind::kPassing;
}

struct StepGoal {
  StepKind kind = StepKind::kFloor;
  Foot foot = Foot::kLeft;
  SolePose target;    // odom
  Foothold foothold;  // the same, world
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
  std::int32_t stair_shift_ticks = 165;    // 0.33 s of double support
  std::int32_t stair_swing_ticks = 450;    // 0.90 s
  std::int32_t passing_swing_ticks = 460;  // 0.92 s
  std::int32_t floor_shift_ticks = 350;
  std::int32_t floor_swing_ticks = 350;
  ComPlan::Params com;
  double max_push_m = 0.03;              // of the zero-moment point, to set off
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
// sooner where the weight is on its way already, or later where it stands over the other foot with little room to push
// off: the first that needs a small push.
void plan_shift(const StepParams& params, const HorizontalMotion& from, std::int32_t least_ticks, StepPlan& plan,
                ComPlan& com) noexcept;

// Eq. (30): one of the N knots of a step; eq. (37): t_i = i dt.
struct StepKnot {
  std::array<Transform, kFootCount> odom_T_sole;
  Transform odom_T_base;
  std::int32_t tick = 0;
};

// The knots of a plan, each made when asked for: nothing is stored.
class StepKnots {
 public:
  StepKnots() noexcept = default;
  StepKnots(const LegGeometry& geometry, const StepParams& params, const StepPlan& plan,
            const TorsoTrajectory::State& from, const std::array<Transform, kFootCount>& soles) noexcept;
  [[nodiscard]] const TorsoPose& torso_at_landing() const noexcept { return torso_at_landing_; }
  [[nodiscard]] HorizontalMotion com_at_landing() const noexcept { return com_.at(shift_ticks_ + swing_ticks_); }
  [[nodiscard]] std::int32_t count() const noexcept { return count_; }
  [[nodiscard]] std::int32_t knot_ticks() const noexcept { return knot_ticks_; }
  [[nodiscard]] StepKnot operator[](std::int32_t i) const noexcept;

 private:
  Foot foot_ = Foot::kLeft;
  std::array<Transform, kFootCount> soles_;
  TorsoTrajectory shift_, lean_;
  ComPlan com_;
  Swing swing_;
  TorsoPose torso_at_landing_;
  std::int32_t shift_ticks_ = 0, swing_ticks_ = 0, knot_ticks_ = 1, count_ = 0;
};

struct StepCheck {
  bool feasible = false;
  double joint_margin_rad = 0.0;  // least, over all knots and joints
  double knee_rad = 0.0;          // least
  double speed_share = 0.0;       // greatest, of the drive's limit
};

// Follows the knots with the leg kinematics, as many per call as the tick can spare.
class StepFeasibility {
 public:
  void begin(const LegGeometry& geometry, const StepParams& params, const StepKnots& knots) noexcept;
  // Up to `count` knots; true when all are done or one cannot be. A knot costs two leg solutions and a centre of mass.
  bool advance(std::int32_t count) noexcept;
  [[nodiscard]] const StepCheck& check() const noexcept { return check_; }
  [[nodiscard]] const StepKnots& knots() const noexcept { return knots_; }

 private:
  // Both legs at a knot; false when one is out of reach. The plan says where the centre of mass is: the base follows
  // from the legs' places in `before`.
  bool solve(std::int32_t i, const JointVector& before_rad, JointVector& q_rad) const noexcept;

  LegGeometry geometry_;
  StepParams params_;
  StepKnots knots_;
  StepCheck check_;
  MassModel masses_;
  JointVector previous_ = JointVector::Zero();
  std::int32_t next_ = 0;
};

// Looks for a shape of a step that both legs can do, kKnotsPerCall knots per call. A leading or passing step is only
// offered when the trailing step after it is possible too.
class StepSearch {
 public:
  enum class State : std::uint8_t { kSearching, kFound, kImpossible };
  static constexpr std::int32_t kKnotsPerCall = 2;  // a tick of the gait costs half as much again
  static constexpr std::int32_t kLookAhead = 2;     // as far apart are the knots of a step that is proved again later

  // trailing: the goal of the step after one that leads; ignored otherwise. shift_ticks: of the shift before the goal's
  // swing, as it will be done.
  void begin(const LegGeometry& geometry, const StepParams& params, const StepGoal& goal, const StepGoal& trailing,
             std::int32_t shift_ticks, const TorsoTrajectory::State& from,
             const std::array<Transform, kFootCount>& soles) noexcept;
  State step() noexcept;
  [[nodiscard]] State state() const noexcept { return state_; }
  [[nodiscard]] const StepPlan& plan() const noexcept { return plan_; }

 private:
  void try_candidate() noexcept;
  [[nodiscard]] bool leads_on() const noexcept;

  LegGeometry geometry_;
  StepParams params_;
  StepGoal goal_, trailing_;
  TorsoTrajectory::State from_{};
  std::array<Transform, kFootCount> soles_;
  StepPlan plan_;       // the offered one, of goal_
  StepPlan candidate_;  // under proof
  StepFeasibility proof_;
  HorizontalMotion com_landed_;  // after the leading swing
  TorsoPose torso_landed_;
  std::int32_t shift_ticks_ = 1;
  std::size_t try_ = 0;
  bool leading_found_ = false;
  State state_ = State::kImpossible;
};

}  // namespace polygmap
