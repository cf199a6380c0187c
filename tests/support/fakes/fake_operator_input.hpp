// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/operator_input.hpp"

namespace polygmap::fakes {

// Commands in the order they were given.
class FakeOperatorInput final : public hal::OperatorInput {
 public:
  static constexpr std::size_t kCapacity = 8;

  void ask(OperatorCommand command) noexcept { commands_.push_overwrite(command); }

  [[nodiscard]] bool try_read(OperatorCommand& command) noexcept override { return commands_.try_pop(command); }

 private:
  RingBuffer<OperatorCommand, kCapacity> commands_;
};

}  // namespace polygmap::fakes
