// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/operator_input.hpp"

namespace polygmap::fakes {

// Commands in the order they were given, and their answers.
class FakeOperatorInput final : public hal::OperatorInput {
 public:
  static constexpr std::size_t kCapacity = 8;

  void ask(OperatorCommand command) noexcept { commands_.push_overwrite(command); }
  // The oldest answer that was not taken; false: there is none.
  [[nodiscard]] bool try_take_answer(OperatorAnswer& answer) noexcept { return answers_.try_pop(answer); }

  [[nodiscard]] bool try_read(OperatorCommand& command) noexcept override { return commands_.try_pop(command); }
  void answer(const OperatorAnswer& answer) noexcept override { answers_.push_overwrite(answer); }

 private:
  RingBuffer<OperatorCommand, kCapacity> commands_;
  RingBuffer<OperatorAnswer, kCapacity> answers_;
};

}  // namespace polygmap::fakes
