// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/operator_input.hpp"

namespace polygmap::fakes {

// Requests in the order they were made, and their answers.
class FakeOperatorInput final : public hal::OperatorInput {
 public:
  static constexpr std::size_t kCapacity = 8;

  void ask(const OperatorRequest& request) noexcept { requests_.push_overwrite(request); }
  // The oldest answer that was not taken; false: there is none.
  [[nodiscard]] bool try_take_answer(OperatorAnswer& answer) noexcept { return answers_.try_pop(answer); }

  [[nodiscard]] bool try_read(OperatorRequest& request) noexcept override { return requests_.try_pop(request); }
  void answer(const OperatorAnswer& answer) noexcept override { answers_.push_overwrite(answer); }

 private:
  RingBuffer<OperatorRequest, kCapacity> requests_;
  RingBuffer<OperatorAnswer, kCapacity> answers_;
};

}  // namespace polygmap::fakes
