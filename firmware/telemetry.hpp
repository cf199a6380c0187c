// SPDX-License-Identifier: Apache-2.0
// The module seen from outside after a tick: for reports, recorders and tests. Never an input.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/estimation/quality/estimate_quality.hpp"
#include "firmware/supervisor.hpp"
#include "hal/ports/joint_bus.hpp"

namespace polygmap {

// What the module that arms waits for: the first of these that lacks.
struct ArmingWait {
  enum class For : std::uint8_t {
    kNothing,  // it has armed, or waits for the next good feedback
    kAnswers,  // of drives
    kErrors,   // that drives tell of, to go
    kRange,    // joints outside it
    kImu,
    kFeet,
  };
  For what = For::kNothing;
  JointSet joints;  // whose
  [[nodiscard]] constexpr bool operator==(const ArmingWait&) const noexcept = default;
};

// What the joints' bus and drives tell of themselves.
struct DriveReport {
  JointSet silent;  // for more than JointFeedback::kCarried_cycles, as of the last feedback; arming: see ControlLane
  JointSet ever_silent;   // since the start
  JointSet out_of_range;  // arming: farther than an encoder may be off, as of the last feedback
  hal::JointBusStatus bus;
};

// References into the module's static object, valid until its next tick or telemetry.
struct Telemetry {
  std::int64_t now_ns;
  const StateEstimate& state;
  const EstimateQuality& quality;  // its covariance, innovations, contacts; stamped with it
  const SurfaceFrame& surfaces;    // newest finished frame; its sequence changes when a new one is done
  const MapSnapshot& map;          // stamp_ns changes in the tick a frame was fused
  const GaitStatus& gait;
  ModuleState module_state;
  const DriveReport& drives;
};

// One line of the static memory table.
struct StageMemory {
  const char* stage;
  std::size_t bytes;
};

}  // namespace polygmap
