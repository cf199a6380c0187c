// SPDX-License-Identifier: Apache-2.0
// What the gait means to do next, as far as it has planned it: for whoever watches it, and never an input. Odometry.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

// How much a planned step may still change.
enum class StepCertainty : std::uint8_t {
  kLatched,   // its foot is in the air: the target is frozen
  kPlanned,   // the weight is on its way for it; its target may move, and it is proved before its foot lifts
  kExpected,  // the one that may come after: nothing of it is proved, its times are the usual durations
};

struct PlannedStep {
  StepCertainty certainty = StepCertainty::kExpected;
  Foot foot = Foot::kLeft;
  bool onto_tread = false;  // false: on the floor while walking up
  bool returns = false;     // to where its foot stood; the target is that place
  // 0: no time is planned, since the plan stands still, or the foot goes back.
  std::int64_t lift_off_ns = 0;
  std::int64_t touch_down_ns = 0;
  Vec3 target_m = Vec3::Zero();  // of the sole frame's origin
  double yaw_rad = 0.0;
  Vec3 up = Vec3::UnitZ();       // normal of what the sole is to lie on
  std::uint32_t polygon_id = 0;  // of the map, that it lies on; 0: none is known
};

// The body at one moment of the plan. What lies beyond the plan's end is its rest.
struct PlannedBody {
  std::int64_t stamp_ns = 0;
  Vec3 p_com_m = Vec3::Zero();
  Vec3 v_com_mps = Vec3::Zero();
  Vec2 zmp_m = Vec2::Zero();
  Vec3 p_base_m = Vec3::Zero();  // over that centre of mass with the legs as they are now
  double base_yaw_rad = 0.0;
};

struct GaitPlan {
  static constexpr std::size_t kSamples = 32;
  static constexpr std::int32_t kSample_ticks = 25;  // 50 ms: 1.55 s in all, a shift of the weight and its swing

  std::int64_t stamp_ns = 0;  // of the tick that it is as of
  // No plan is made: nothing is commanded, or it balances as it was met. Then the rest is not set.
  bool planned = false;
  // A drive is mute: the body stays where it is, and bodies has only that.
  bool held = false;
  std::array<Transform, kFootCount> odom_T_sole;  // where the soles are to be now
  StaticVector<PlannedStep, 2> steps;             // in their order
  StaticVector<PlannedBody, kSamples> bodies;     // from stamp_ns on
  bool has_landing = false;                       // the first step's touch-down has a time
  PlannedBody landing;                            // at that time
};

}  // namespace polygmap
