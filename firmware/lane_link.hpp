// SPDX-License-Identifier: Apache-2.0
// Everything that crosses between the control lane and the perception lane. Each exchange has one writer and one
// reader.
#pragma once

#include "algorithms/core/containers/exchange.hpp"
#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/state.hpp"
#include "scheduler/health.hpp"

namespace polygmap {

// Perception asks for the pose at a frame's exposure; control, which owns the past, answers in its next frame.
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

struct LaneLink {
  Exchange<PoseRequest> pose_request;      // perception -> control
  Exchange<PoseAnswer> pose_answer;        // control -> perception
  Exchange<SearchContext> search_context;  // control -> perception
  Exchange<FootholdSet> footholds;         // perception -> control
  Exchange<Health> health;                 // perception -> control
};

}  // namespace polygmap
