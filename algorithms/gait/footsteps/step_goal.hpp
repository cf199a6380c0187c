// SPDX-License-Identifier: Apache-2.0
// What a step is to reach: what the planner of footsteps decides and the trajectories carry out.
#pragma once

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/gait/footsteps/footstep_plan.hpp"

namespace polygmap {

enum class StepKind : std::uint8_t {
  kFloor,     // on level ground
  kLeading,   // the first foot onto the next tread
  kTrailing,  // the second, beside it
  kPassing,   // or past it onto the tread beyond
  kClosing,   // back beside it, on the same tread, from a place too far out
};
[[nodiscard]] constexpr bool on_level(StepKind kind) noexcept {
  return kind == StepKind::kFloor || kind == StepKind::kClosing;
}
[[nodiscard]] constexpr bool onto_tread(StepKind kind) noexcept { return kind != StepKind::kFloor; }
// It lands on another level than the other foot stands on, and the weight goes on to it.
[[nodiscard]] constexpr bool leads(StepKind kind) noexcept {
  return kind == StepKind::kLeading || kind == StepKind::kPassing;
}

struct StepGoal {
  StepKind kind = StepKind::kFloor;
  Foot foot = Foot::kLeft;
  SolePose target;      // odom
  Foothold foothold{};  // the same, as it was found
};

}  // namespace polygmap
