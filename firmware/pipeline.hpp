// SPDX-License-Identifier: Apache-2.0
// The wiring: ports in, joint commands out. One static object; nothing is allocated.
#pragma once

#include <span>

#include "firmware/control_lane.hpp"
#include "firmware/perception_lane.hpp"
#include "firmware/telemetry.hpp"
#include "scheduler/cyclic_executive.hpp"

namespace polygmap {

#if defined(EIGEN_VECTORIZE) || EIGEN_MAX_STATIC_ALIGN_BYTES != 0
#error "Eigen sums and aligns in another way here than in the module: compile with -DEIGEN_DONT_VECTORIZE"
#endif

struct Ports {
  hal::DepthCamera& camera;
  hal::Imu& imu;
  hal::JointBus& joints;
  hal::LidarOdometry& lio;
  hal::OperatorInput* operator_input = nullptr;  // null: nobody asks anything of the module but to stop
};

// Runs the tasks of the schedule's rows (schedule.hpp) for the executives. Rows of different lanes may run on different
// threads.
class Pipeline {
 public:
  Pipeline(const Ports& ports, const Params& params) noexcept
      : params_(params),
        control_({ports.imu, ports.joints, ports.lio, ports.operator_input}, link_, health_, params_),
        perception_(ports.camera, link_, health_[kPerceptionLane], params_) {}
  Pipeline(const Pipeline&) = delete;  // the lanes refer to the link inside
  Pipeline& operator=(const Pipeline&) = delete;

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept;

  // Told by the executive when a cycle is over: from the next one on the other lane sees what was published in it.
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept;
  // The same of one of the module's lanes; a replay says by it how far the other one was.
  void lane_finished(std::size_t lane, std::int64_t cycle_ns) noexcept {
    link_.progress[lane].finished_ns.store(cycle_ns, std::memory_order_release);
  }
  // What crosses between the lanes, for a replay.
  [[nodiscard]] ControlPerceptionLink& link() noexcept { return link_; }
  [[nodiscard]] const ControlPerceptionLink& link() const noexcept { return link_; }
  [[nodiscard]] Exchange<Health, kEveryFrameSlots>& published_health(std::size_t lane) noexcept {
    return health_[lane].published;
  }
  [[nodiscard]] const Exchange<Health, kEveryFrameSlots>& published_health(std::size_t lane) const noexcept {
    return health_[lane].published;
  }

  [[nodiscard]] ControlLane& control() noexcept { return control_; }
  [[nodiscard]] const ControlLane& control() const noexcept { return control_; }
  [[nodiscard]] PerceptionLane& perception() noexcept { return perception_; }
  [[nodiscard]] const PerceptionLane& perception() const noexcept { return perception_; }
  // Where that lane's executive counts its own.
  [[nodiscard]] Health& lane_health(std::size_t lane) noexcept { return health_[lane].own; }
  // Everything that all lanes and their executives counted; other lanes' as of their last cycle. Control's thread only.
  [[nodiscard]] const Health& health() const noexcept { return control_.all_faults(); }
  // Before the first tick: from then on perception copies what it finishes into memory of whoever watches.
  void watch(PerceptionTelemetry& perception) noexcept { perception_.watch(perception); }
  // perception: what watch() was given. Control's thread only; what it refers to stays until the next call.
  [[nodiscard]] Telemetry telemetry(std::int64_t now_ns, PerceptionTelemetry& perception) const noexcept;

 private:
  Params params_;
  ControlPerceptionLink link_;
  LaneHealths health_;
  ControlLane control_;
  PerceptionLane perception_;
};

// The module's static memory, stage by stage: sizeof(Pipeline), the executives and the stacks of all lanes.
inline constexpr std::size_t kMemoryBudget_bytes = 16U * 1024U * 1024U;
// Of a lane's thread, at least: the smallest stack that a thread may have on AArch64. toolchain/checks/stack refuses
// chains of calls of a quarter of it.
inline constexpr std::size_t kLaneStack_bytes = 128U * 1024U;
[[nodiscard]] std::span<const StageMemory> static_memory() noexcept;

}  // namespace polygmap
