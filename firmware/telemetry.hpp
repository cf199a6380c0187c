// SPDX-License-Identifier: Apache-2.0
// The module seen from outside after a tick: for reports, recorders and tests. Never an input.
#pragma once

#include <cstddef>
#include <cstdint>

#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/estimation/quality/estimate_quality.hpp"

namespace polygmap {

// References into the module's static object, valid until its next tick or telemetry.
struct Telemetry {
  std::int64_t now_ns;
  const StateEstimate& state;
  const EstimateQuality& quality;  // its covariance, innovations, contacts; stamped with it
  const SurfaceFrame& surfaces;    // newest finished frame; its sequence changes when a new one is done
  const MapSnapshot& map;          // stamp_ns changes in the tick a frame was fused
  const GaitStatus& gait;
};

// One line of the static memory table.
struct StageMemory {
  const char* stage;
  std::size_t bytes;
};

}  // namespace polygmap
