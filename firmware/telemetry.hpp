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
    kCooler,   // drives, that are too hot
    kRange,    // joints outside it
    kImu,
    kFeet,
    kStrength,  // of gravity, as the IMU feels it
    kSoles,     // to be parallel by the encoders
    kGravity,   // to be where the soles have it
  };
  For what = For::kNothing;
  JointSet joints;             // whose
  std::uint16_t lean_deg = 0;  // of the last two
  [[nodiscard]] constexpr bool leans() const noexcept { return what >= For::kSoles; }
  [[nodiscard]] constexpr bool operator==(const ArmingWait&) const noexcept = default;
};
// Joints or degrees go before or after it.
[[nodiscard]] constexpr std::string_view text_of(ArmingWait::For what) noexcept {
  constexpr std::array<std::string_view, 10> kTexts{
      "",
      "no answer yet from",
      "in error:",
      "too hot:",
      "out of range:",
      "too few IMU samples",
      "no forces of the feet",
      "gravity that the IMU feels is not 9.81 m/s^2: suspect its unit, or an axis that is dead",
      "deg between the soles' normals by the encoders: suspect an encoder's zero or sign, or a foot that does not "
      "stand",
      "deg between gravity as the IMU feels it and the soles' normal: suspect the IMU's mount (imu.base_rpy_rad, "
      "robot.mounts.base_R_imu), then both legs' encoders, then the floor"};
  static_assert(kTexts.size() == static_cast<std::size_t>(ArmingWait::For::kGravity) + 1);
  return kTexts[static_cast<std::size_t>(what)];
}

// What the joints' bus and drives tell of themselves.
struct DriveReport {
  JointSet silent;  // for more than JointFeedback::kCarried_cycles, as of the last feedback; arming: see ControlLane
  JointSet ever_silent;   // since the start
  JointSet out_of_range;  // arming: farther than an encoder may be off, as of the last feedback
  JointSet hot;           // too hot, until they have cooled (Supervisor)
  JointSet ever_hot;      // since the start
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
  ArmingWait arming_waits_for;
  const DriveReport& drives;
};

// One line of the static memory table.
struct StageMemory {
  const char* stage;
  std::size_t bytes;
};

}  // namespace polygmap
