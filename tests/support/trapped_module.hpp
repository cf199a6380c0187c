// SPDX-License-Identifier: Apache-2.0
// The module as a robot has it, in one lane: pipeline and executive live in memory that is there beforehand, and are
// made, started and called inside the heap trap.
#pragma once

#include <memory>
#include <optional>

#include "firmware/schedule.hpp"
#include "sim_stub/heap_trap.hpp"

namespace polygmap::test {

class TrappedModule {
 public:
  using Executive = OneLaneExecutive<>;

  TrappedModule(const Ports& ports, const Params& params, const hal::Clock& clock)
      : clock_(clock), memory_(std::make_unique<Memory>()) {
    const heap::ModuleCall call("Pipeline::Pipeline");
    memory_->pipeline.emplace(ports, params);
    memory_->executive.emplace(pipeline(), clock, pipeline().lane_health(0));
    memory_->executive->start(clock.now_ns() + kCycle_ns);
  }
  void tick() {
    const heap::ModuleCall call("CyclicExecutive::tick");
    memory_->executive->tick(clock_.now_ns());
  }
  [[nodiscard]] Executive& executive() { return *memory_->executive; }
  [[nodiscard]] Pipeline& pipeline() { return *memory_->pipeline; }
  [[nodiscard]] const Pipeline& pipeline() const { return *memory_->pipeline; }

 private:
  struct Memory {
    std::optional<Pipeline> pipeline;
    std::optional<Executive> executive;
  };
  const hal::Clock& clock_;
  std::unique_ptr<Memory> memory_;
};

}  // namespace polygmap::test
