// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/operator_answer.hpp"
#include "algorithms/core/messages/operator_command.hpp"

namespace polygmap::hal {

class OperatorInput {
 public:
  // The oldest command that was given and not yet read; false, and command untouched, when there is none. Never blocks.
  [[nodiscard]] virtual bool try_read(OperatorCommand& command) noexcept = 0;
  // Of the command that was read last, once, in the cycle that read it. Whoever asked has to hear of a refusal.
  virtual void answer(const OperatorAnswer& answer) noexcept = 0;

 protected:
  ~OperatorInput() = default;
};

}  // namespace polygmap::hal
