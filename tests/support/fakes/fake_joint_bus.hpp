// SPDX-License-Identifier: Apache-2.0
// Gives the feedback a test feeds and remembers the commands it was given.
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/joint_bus.hpp"
#include "tests/support/fakes/call_script.hpp"

namespace polygmap::fakes {

class FakeJointBus final : public hal::JointBus {
 public:
  static constexpr std::size_t kCommandsKept = 256;

  void feed(const JointFeedback& feedback) noexcept {
    newest_ = feedback;
    fresh_ = true;
  }
  CallScript reads;   // a failing read leaves the feedback where it is
  CallScript writes;  // a failing write sends nothing

  // What reached the drives, the last kCommandsKept of it.
  [[nodiscard]] const RingBuffer<JointCommand, kCommandsKept>& commands() const noexcept { return commands_; }

  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (reads.next_fails() || !fresh_) return false;
    feedback = newest_;
    fresh_ = false;
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    if (writes.next_fails()) return {};
    commands_.push_overwrite(command);
    return JointSet::all();
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return told; }

  hal::JointBusStatus told;

 private:
  JointFeedback newest_;
  bool fresh_ = false;
  RingBuffer<JointCommand, kCommandsKept> commands_;
};

}  // namespace polygmap::fakes
