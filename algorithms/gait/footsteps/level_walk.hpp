// SPDX-License-Identifier: Apache-2.0
// Steps on level ground to a place, each on ground that was seen and past nothing that rises.
#pragma once

#include <cmath>
#include <optional>

#include "algorithms/core/messages/ground_view.hpp"
#include "algorithms/gait/footsteps/footstep_plan.hpp"

namespace polygmap {

// Odometry.
struct WalkGoal {
  Vec2 odom_p_m = Vec2::Zero();  // of the middle between the feet
  double yaw_rad = 0.0;
  bool has_yaw = false;  // false: any heading will do
  double odom_z_m = 0.0;
  bool has_height = false;  // false: any storey will do

  // A tread apart are two heights that differ by more. Chosen between the least rise of a tread that is climbed often,
  // 0.15 m, and what odometry drifts over a flight.
  static constexpr double kSameHeight_m = 0.09;
  // It lies on the ground that z_m is the height of, for all that is known.
  [[nodiscard]] bool is_at_height(double z_m) const noexcept {
    return !has_height || std::abs(odom_z_m - z_m) < kSameHeight_m;
  }
  // From the ground at z_m a rise, negative down, comes nearer to its height. None: its height says nothing.
  [[nodiscard]] std::optional<bool> is_by_rise(double z_m, double rise_m) const noexcept {
    if (is_at_height(z_m) || rise_m == 0.0) return std::nullopt;
    return std::abs(odom_z_m - z_m - rise_m) < std::abs(odom_z_m - z_m);
  }
};

struct LevelWalkParams {
  double near_m = 0.30;
  double turn_first_rad = 0.5;
  double turn_out = 5.0;
  double within_m = 0.03;
  double within_rad = 0.06;
  double sole_margin_m = 0.045;
  double body_m = 0.30;
  double level_m = 0.03;
  double stairs_beyond_m = 0.10;
  double stairs_aside_rad = 1.2;

  static void visit(auto& p, auto& field) {
    field("near_m", p.near_m, 0.0, 2.0, "As near to the goal it no longer turns towards it, but as it is to stand.");
    field("turn_first_rad", p.turn_first_rad, 0.05, 3.2, "It turns in place towards a goal that lies farther round.");
    field("turn_out", p.turn_out, 1.0, 6.0,
          "A foot that turns away from the other one does so as many times as far as one that turns towards it.");
    field("within_m", p.within_m, 0.005, 0.2, "A foot is at the goal within this, along and across.");
    field("within_rad", p.within_rad, 0.01, 0.5, "A foot is at the goal within this turn.");
    field("sole_margin_m", p.sole_margin_m, 0.0, 0.2,
          "Ground was seen as far beyond a sole on all sides: a square of 40 mm may be half over an edge.");
    field("body_m", p.body_m, 0.0, 1.0, "What rises as near to the middle between the feet comes no nearer by a step.");
    field("level_m", p.level_m, 0.005, 0.1, "What was seen from soles at another height than this says nothing.");
    field("stairs_beyond_m", p.stairs_beyond_m, 0.0, 2.0,
          "Stairs lead to a goal that lies farther behind their nosing.");
    field("stairs_aside_rad", p.stairs_aside_rad, 0.1, 3.2,
          "They do not where it lies farther round from their heading.");
  }
};

struct LevelStep {
  enum class Outcome : std::uint8_t { kSteps, kArrived, kNoGround, kBlocked };
  Outcome outcome = Outcome::kNoGround;
  Foot foot = Foot::kLeft;
  SolePose target;
};

class LevelWalk {
 public:
  struct LastSwing {
    Foot foot = Foot::kRight;
    std::int32_t in_a_row = 1;  // steps of that foot
    bool begins = false;        // that was before this walk
  };
  // sole, half_width_m: of the robot. limits: of a step.
  LevelWalk(const LevelWalkParams& params, const SoleModel& sole, double half_width_m, const FloorStepLimits& limits,
            const SwingRule& rule) noexcept
      : params_(params), sole_(sole), half_width_m_(half_width_m), limits_(limits), rule_(rule) {}

  [[nodiscard]] LevelStep next(const SolePair& soles, const LastSwing& last, const WalkGoal& goal,
                               const GroundView& ground) const noexcept;
  // Both feet stand at the goal, at its height.
  [[nodiscard]] bool has_arrived(const SolePair& soles, const WalkGoal& goal) const noexcept;
  // Ground was seen under all of the sole.
  [[nodiscard]] static bool carries(const GroundView& ground, const OrientedRectangle& sole) noexcept;
  // By what the steepest ramp rises over a metre, where one is on the straight way, as far as a few steps lead; 0:
  // none.
  [[nodiscard]] static double ramp_on_way(const GroundView& ground, const Vec2& from_m, const Vec2& to_m) noexcept;
  // To the nearest square that rises; most_m where there is none as near.
  [[nodiscard]] static double clearance_m(const GroundView& ground, const Vec2& odom_p_m, double most_m) noexcept;

 private:
  [[nodiscard]] bool is_there(const SolePose& sole, Foot foot, const TorsoPose& at) const noexcept;
  struct Aim {
    TorsoPose pose;
    bool turns_first;
  };
  [[nodiscard]] Aim aim(const TorsoPose& middle, const WalkGoal& goal) const noexcept;
  // Of step.foot, shorter or aside where it must be; false: its outcome says why not.
  [[nodiscard]] bool try_steps(const SolePair& soles, const Aim& to, const GroundView& ground,
                               LevelStep& step) const noexcept;
  // The same of one place. now_m: clearance of the body as it stands.
  [[nodiscard]] bool try_step(const SolePair& soles, const TorsoPose& to, const FloorStepLimits& limits,
                              const GroundView& ground, double now_m, LevelStep& step) const noexcept;

  const LevelWalkParams& params_;
  const SoleModel& sole_;
  double half_width_m_;
  FloorStepLimits limits_;
  SwingRule rule_;
};

}  // namespace polygmap
