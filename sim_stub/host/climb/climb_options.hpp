// SPDX-License-Identifier: Apache-2.0
// What a simulated climb is told: the stairs, the camera, and which errors the robot has.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/gait/footsteps/climb_planner.hpp"
#include "firmware/config/bus_file.hpp"
#include "firmware/config/camera_file.hpp"
#include "firmware/params.hpp"
#include "sim_stub/camera/noise_kind.hpp"
#include "sim_stub/host/operator/climb_operator.hpp"
#include "sim_stub/host/world_file.hpp"
#include "sim_stub/reality.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap {
class LiveDisplay;
}
namespace polygmap::sim {

[[nodiscard]] inline std::string name_of(GaitPattern gait) {
  return std::string(kGaitPatternNames[static_cast<std::size_t>(gait)]);
}

struct ClimbOptions {
  StairParams stairs;
  std::optional<WorldFile> world;  // in their stead
  std::string world_file;          // that it was read from, or is written to
  std::string world_kind;          // that it was drawn of; empty: of none
  std::string world_drawn;         // and what was, in one sentence
  bool comes_back = false;         // from the world's goal to where it started
  std::uint64_t seed = 1;
  NoiseKind noise = NoiseKind::kWhite;
  PlantKind plant = PlantKind::kMujoco;
  std::vector<std::string> command;  // that was typed; for the record
  std::vector<Push> pushes;
  std::vector<TimedRequest> asked;          // of an operator with a script; for the record
  ClimbOperator* climb_operator = nullptr;  // null: the module starts by itself. Outlives the climb
  double reality_scale = 0.0;               // that reality was drawn at
  Reality reality;                          // the robot and the ground as they are; the module believes the data sheet
  GaitPattern gait = GaitPattern::kDoubleStep;
  std::string out_dir;       // empty: no files
  bool save_inputs = false;  // what the sensors said, in out_dir/inputs, a directory that exists
  // All that goes into the module and comes out of it; empty: nothing. In a directory that exists.
  std::string recording;
  bool record_pictures = false;  // too
  double time_limit_s = 150.0;   // simulated
  // Becomes the number of the signal that asks for the end; the climb then ends with what there is. Null: none may.
  const std::atomic<int>* interrupt = nullptr;
  double pace = 0.0;               // simulated seconds in one of the wall clock's, at most; 0: as fast as it can
  LiveDisplay* display = nullptr;  // of who watches; null: nobody. Outlives the climb
  std::string mailbox;             // for programs that watch; empty: there is none
  bool threaded_render = true;
  // Causality tests: the picture shows something else than the plant stands on.
  double render_dx_m = 0.0, render_dy_m = 0.0, render_dz_m = 0.0;
  int render_missing_step = -1;  // 0-based, -1: none
  bool blank_depth = false;
  bool self_filter = true;
  std::optional<config::CameraProfile> camera;  // the robot's own when absent; the module is told its noise and range
  std::string camera_file;                      // that it was read from
  double scan_ms = 16.0;                        // one exposure, top to bottom; SimDepthCamera rounds it
  // The module's parameters; what else is said here of the module goes before. The IMU is as they say.
  Params params;
  std::string params_file;  // that they were read from
  bool estimate_mount = true;
  // The joints are behind these buses, else wired directly. What the drives can do binds the module's robot.
  std::optional<config::BusFile> bus;
  std::string can_log;        // every frame on the buses, as candump -L writes it; empty: none
  bool foot_sensors = false;  // else contacts are told by joint torques alone
};

}  // namespace polygmap::sim
