// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

class JointBus {
 public:
  // The newest complete feedback of all joints; false, and feedback untouched, when none arrived since the last call.
  // Never blocks.
  [[nodiscard]] virtual bool try_read(JointFeedback& feedback) noexcept = 0;
  // Hands one command for every joint to the drives; false, and none of it sent, when the bus would not take it. Never
  // blocks.
  [[nodiscard]] virtual bool try_write(const JointCommand& command) noexcept = 0;

 protected:
  ~JointBus() = default;
};

}  // namespace polygmap::hal
