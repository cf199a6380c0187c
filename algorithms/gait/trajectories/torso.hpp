// SPDX-License-Identifier: Apache-2.0
// The torso: where it must be over the feet, how high the legs let it be, and the way from one such pose to the next.
#pragma once

#include <array>

#include "algorithms/gait/footsteps/footstep_plan.hpp"
#include "algorithms/gait/trajectories/quintic.hpp"

namespace polygmap {

struct TorsoParams {
  double height_m = 0.795;
  double lead_height_m = 0.86;
  double max_leg_m = 0.612;
  double inward_m = 0.022;
  double ahead_m = 0.0;
  std::int32_t min_lowering_ticks = 130;
  double max_lowering_mps2 = 4.0;

  static void visit(auto& p, auto& field) {
    field("height_m", p.height_m, 0.5, 0.9, "Torso above the higher foot, at most.");
    field("lead_height_m", p.lead_height_m, 0.5, 1.0, "Torso above the lower foot when the leading one lands.");
    field("max_leg_m", p.max_leg_m, 0.4, 0.63, "Hip pitch to ankle, of 0.630 stretched.");
    field("inward_m", p.inward_m, -0.1, 0.1, "Base at rest over one foot, from its middle line towards the other one.");
    field("ahead_m", p.ahead_m, -0.1, 0.1, "Base at rest over one foot, ahead of its sole's origin.");
    field("min_lowering_ticks", p.min_lowering_ticks, 2, 2000, "The torso comes down in no less time.");
    field("max_lowering_mps2", p.max_lowering_mps2, 0.1, 9.0,
          "The torso comes down with no larger acceleration, so that the foot stays pressed enough to balance.");
  }
};

// Base height at which the leg to `sole` is max_leg_m long, for a base at (x, y) with that heading and lean.
[[nodiscard]] double reach_height_m(const LegGeometry& geometry, const TorsoPose& base, Foot leg, const SolePose& sole,
                                    double max_leg_m) noexcept;

// With its base there, heading between the soles and as much to the left, leaning ahead; height: the highest that both
// feet allow.
[[nodiscard]] TorsoPose torso_at(const LegGeometry& geometry, const TorsoParams& params, const SolePair& soles,
                                 const Vec2& base_m, double turn_rad = 0.0, double lean_rad = 0.0) noexcept;
// At rest over the foot that stands alone.
[[nodiscard]] TorsoPose torso_over(const LegGeometry& geometry, const TorsoParams& params, Foot stance,
                                   const SolePair& soles) noexcept;
// Time for the torso to come down by that much without falling faster than a foot pressed enough to balance allows.
[[nodiscard]] std::int32_t lowering_ticks(const TorsoParams& params, double drop_m) noexcept;
// Between both feet.
[[nodiscard]] TorsoPose torso_between(const LegGeometry& geometry, const TorsoParams& params,
                                      const SolePair& soles) noexcept;

// x, y, z, roll, pitch, yaw: height and attitude move from any motion to a rest without roll; x and y are the centre of
// mass's and come from elsewhere (com_plan.hpp).
class TorsoTrajectory {
 public:
  static constexpr std::size_t kAxes = 6;
  using State = std::array<Motion, kAxes>;

  [[nodiscard]] static State at_rest(const Transform& base) noexcept;
  [[nodiscard]] static Transform pose(const State& state) noexcept;
  // The state in another frame that differs by a small rigid motion, in which base and centre of mass are there: speeds
  // stay.
  [[nodiscard]] static State placed(const State& state, const Transform& base, const Vec2& com_m) noexcept;

  [[nodiscard]] static HorizontalMotion horizontal(const State& state) noexcept;
  static void set_horizontal(State& state, const HorizontalMotion& motion) noexcept;

  // goal: but for x and y. height_ticks: the height may arrive earlier than the rest.
  void plan(const State& from, const TorsoPose& goal, std::int32_t duration_ticks, std::int32_t height_ticks) noexcept;
  // x and y as set in `horizontal`.
  [[nodiscard]] State at(std::int32_t tick, const HorizontalMotion& horizontal) const noexcept;

 private:
  std::array<Quintic, kAxes - 2> axes_;  // from z on
};

}  // namespace polygmap
