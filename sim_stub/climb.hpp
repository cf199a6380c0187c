// SPDX-License-Identifier: Apache-2.0
// One simulated climb: robot, module and report in a closed loop.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "sim_stub/camera_profile.hpp"
#include "sim_stub/climb_summary.hpp"
#include "sim_stub/noise_kind.hpp"
#include "sim_stub/plant.hpp"
#include "sim_stub/stair_world.hpp"

namespace polygmap::sim {

struct ClimbOptions {
  StairParams stairs;
  std::uint64_t seed = 1;
  DepthNoise noise = DepthNoise::kWhite;
  PlantKind plant = PlantKind::kKinematic;
  std::string gait = "ds";
  std::string out_dir;          // empty: no files
  double time_limit_s = 150.0;  // simulated
  bool threaded_render = true;
  // Causality tests: the picture shows something else than the plant stands on.
  double render_dx_m = 0.0, render_dy_m = 0.0, render_dz_m = 0.0;
  int render_missing_step = -1;  // 0-based, -1: none
  bool blank_depth = false;
  bool self_filter = true;
  // The camera, and what the module is not told of it. Of a seed's errors, half ranges.
  std::optional<CameraProfile> camera;  // the robot's own when absent; the module is told its noise and range
  double scan_ms = 16.0;                // one exposure, top to bottom, to the nearest 4 ms
  double mount_error_deg = 1.0;         // roll, pitch, yaw; and 3 mm per degree in each direction
  double scale_error = 0.003;
  bool estimate_mount = true;
};

// Called about once per simulated second: step, simulated time, worst row of the schedule.
struct ClimbProgress {
  double time_s;
  int treads_climbed;
  const char* phase;
  const char* worst_row;
  double worst_row_us;
};

using ClimbProgressFunction = std::function<void(const ClimbProgress&)>;

// The climb is over, but its files could not be written: one sentence, and the verdict that is worth a minute.
struct ClimbNotWritten : std::runtime_error {
  ClimbNotWritten(const std::string& sentence, ClimbSummary climbed)
      : std::runtime_error(sentence), summary(std::move(climbed)) {}
  ClimbSummary summary;
};

// Runs one climb to its end and, unless options.out_dir is empty, writes summary.json and climb.svg there (the
// directory exists). Throws ClimbNotWritten when it cannot write.
[[nodiscard]] ClimbSummary run_climb(const ClimbOptions& options, const ClimbProgressFunction& progress);

}  // namespace polygmap::sim
