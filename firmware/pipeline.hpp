// SPDX-License-Identifier: Apache-2.0
// The wiring: ports in, joint commands out. One static object; nothing is allocated.
#pragma once

#include <array>

#include "firmware/control_lane.hpp"
#include "firmware/perception_lane.hpp"
#include "firmware/schedule.hpp"
#include "firmware/telemetry.hpp"

namespace polygmap {

struct Ports {
  hal::DepthCamera& camera;
  hal::Imu& imu;
  hal::JointBus& joints;
  hal::LidarOdometry& lio;
};

// The tasks of the schedule's rows; a CyclicExecutive runs them. Rows of different lanes may run on different threads.
class Pipeline {
 public:
  Pipeline(const Ports& ports, const Params& params) noexcept
      : params_(params),
        control_(ports.imu, ports.joints, ports.lio, link_, params_),
        perception_(ports.camera, link_, params_) {}
  Pipeline(const Pipeline&) = delete;  // the lanes refer to the link inside
  Pipeline& operator=(const Pipeline&) = delete;

  Progress run_row(std::size_t row, std::int64_t frame_ns, WorkBudget& budget) noexcept;

  [[nodiscard]] ControlLane& control() noexcept { return control_; }
  [[nodiscard]] const ControlLane& control() const noexcept { return control_; }
  [[nodiscard]] const PerceptionLane& perception() const noexcept { return perception_; }
  // Where that lane's executive counts its own.
  [[nodiscard]] Health& lane_health(std::size_t lane) noexcept {
    return lane == 0 ? control_.faults() : perception_.faults();
  }
  // Everything that both lanes and their executives counted; perception's as of its last frame. Control's thread only.
  [[nodiscard]] const Health& health() const noexcept { return control_.all_faults(); }
  [[nodiscard]] Telemetry telemetry(std::int64_t now_ns) const noexcept;

 private:
  Params params_;
  LaneLink link_;
  ControlLane control_;
  PerceptionLane perception_;
};

// The module's static memory, stage by stage: sizeof(Pipeline), where "other" is what its stages do not account for,
// the executives and the stacks of both lanes.
inline constexpr std::size_t kMemoryBudget_bytes = 16U * 1024U * 1024U;
// Of a lane's thread: what it is to be given. toolchain/checks/stack refuses chains of calls of half of it.
inline constexpr std::size_t kLaneStack_bytes = 64U * 1024U;
inline constexpr std::size_t kMemoryStages = 10;
[[nodiscard]] std::array<StageMemory, kMemoryStages> static_memory() noexcept;

}  // namespace polygmap
