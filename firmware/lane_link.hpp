// SPDX-License-Identifier: Apache-2.0
// The lanes, and everything that crosses between them. Each exchange has one writer and one reader.
#pragma once

#include <array>

#include "algorithms/core/containers/exchange.hpp"
#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "firmware/faults.hpp"

namespace polygmap {

enum Lane : std::uint8_t { kControlLane, kPerceptionLane, kLaneCount };

// A lane's faults and limits. Its thread counts in `own` and publishes; control reads what was published.
struct LaneHealth {
  Health own;
  Exchange<Health> published;

  void publish() noexcept { published.publish(own); }
};
using LaneHealths = std::array<LaneHealth, kLaneCount>;

// Perception asks for the pose at a frame's exposure; control, which owns the past, answers in its next cycle.
struct PoseRequest {
  std::uint32_t number = 0;  // the answer has the same
  std::int64_t stamp_ns = 0;
};
struct PoseAnswer {
  std::uint32_t number = 0;
  bool found = false;
  StateEstimate state;
};

// What the foothold search needs to know of the robot.
struct SearchContext {
  StateEstimate state;
  Foot stance = Foot::kLeft;  // the foot that stays
  bool climbing = false;      // has stepped onto a tread
};

// The pair of control and perception.
struct ControlPerceptionLink {
  Exchange<PoseRequest> pose_request;      // perception -> control
  Exchange<PoseAnswer> pose_answer;        // control -> perception
  Exchange<SearchContext> search_context;  // control -> perception
  Exchange<FootholdSet> footholds;         // perception -> control
};

// What perception made, copied out when it was finished, for whoever watches the module on control's thread.
struct PerceptionTelemetry {
  Exchange<SurfaceFrame> surfaces;
  Exchange<MapSnapshot> map;
};

}  // namespace polygmap
