// SPDX-License-Identifier: Apache-2.0
// What the gait tells estimation (which feet stand), the report and the operator.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

enum class GaitPhase : std::uint8_t {
  kStandstill,     // both feet stand, the estimator is initialising or nothing is planned yet
  kDoubleSupport,  // weight moves over the next stance foot
  kSwing,          // one foot in the air, on its way or on its way back
  kFinished,       // on top, the climb is over
  kStopped,        // both feet stand; stop_reason says why
};
[[nodiscard]] constexpr std::string_view name_of(GaitPhase phase) noexcept {
  constexpr std::array<std::string_view, 5> kNames{"standing", "double_support", "swing", "finished", "stopped"};
  static_assert(kNames.size() == static_cast<std::size_t>(GaitPhase::kStopped) + 1);
  const auto i = static_cast<std::size_t>(phase);
  return i < kNames.size() ? kNames[i] : "unknown";
}

// A footstep as it was frozen at lift-off ("latch") and what became of it.
struct LatchedStep {
  std::uint32_t sequence = 0;  // counts swings from 1; 0: none yet
  Foot foot = Foot::kLeft;
  bool onto_tread = false;  // false: a step on the floor while walking up
  // The target's height is a mapped tread's; false where it is the estimate's own: on the floor, beside the other foot.
  bool height_mapped = false;
  std::int64_t latch_stamp_ns = 0;
  std::int64_t map_stamp_ns = 0;         // exposure of the newest fused frame at the latch
  Foothold target;                       // in odometry, as it was found
  Transform odom_T_target;               // the same sole pose in the odometry frame that the swing is steered in
  std::int64_t touch_down_stamp_ns = 0;  // 0 while in the air, and for ever when the swing was aborted
  Transform odom_T_executed;             // estimated sole pose at touch-down
};

struct GaitStatus {
  std::int64_t stamp_ns = 0;
  GaitPhase phase = GaitPhase::kStandstill;
  StopReason stop_reason = StopReason::kNone;
  double stop_measured_m = 0.0;                     // the rise, tread or slope behind stop_reason
  LatchedStep step;                                 // the current or the last swing
  std::uint32_t treads_climbed = 0;                 // both feet on it, by the module's own count
  std::array<bool, kFootCount> stands{true, true};  // planned contact
  std::array<bool, kFootCount> on_toe{};            // of a foot that stands: its heel rises, only the toe's edge rests
  std::array<Transform, kFootCount> odom_T_sole_desired;
  Vec2 odom_p_com_desired_m = Vec2::Zero();  // planned centre of mass, laid on the estimate by the standing soles
  std::uint32_t ik_limited_ticks = 0;        // ticks in which a leg could not reach what was asked
  std::uint32_t early_contacts = 0;
  std::uint32_t late_contacts = 0;
  std::uint32_t aborted_swings = 0;  // feet that turned back in the air to where they had stood
};

}  // namespace polygmap
