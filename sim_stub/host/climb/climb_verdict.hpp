// SPDX-License-Identifier: Apache-2.0
// Whether a climb passed and why: a sentence, and one for every push that it did not live to see.
#pragma once

#include <cstdint>
#include <string>

#include "algorithms/core/messages/samples.hpp"
#include "firmware/telemetry.hpp"
#include "sim_stub/host/climb/climb_summary.hpp"

namespace polygmap::sim {

// What its operator has to do with the run's end.
enum class OperatorEnd : std::uint8_t {
  kNone,
  kAsksNoMore,  // and the module waits for a command
  kLeft,        // quit, or the input ended
};

// How the run ended, in the module's words and in the plant's.
struct ClimbEnding {
  ModuleState module_state{};
  OperatorEnd operator_end = OperatorEnd::kNone;
  GaitPhase phase = GaitPhase::kStandstill;
  StopReason stop_reason = StopReason::kNone;
  ArmingWait arming_waits_for;
  double stop_measured_m = 0.0;
  std::string fall_reason;        // a sentence; empty when it did not fall
  std::string heap_first_caller;  // the function, when the module called the heap
};

// Passed: all steps climbed, no fall, no sole over an edge, no touch of the stairs in a swing, no heap call. Sets pass
// and reason; the figures must be there. Pushes that never came are named, whatever the verdict.
void judge(ClimbSummary& summary, const ClimbEnding& ending);

}  // namespace polygmap::sim
