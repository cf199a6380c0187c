// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/operator_answer.hpp"
#include "algorithms/core/messages/operator_command.hpp"

namespace polygmap::hal {

class OperatorInput {
 public:
  // The oldest request that was made and not yet read; false, and request untouched, when there is none. Never blocks.
  [[nodiscard]] virtual bool try_read(OperatorRequest& request) noexcept = 0;
  // Of the request that was read last, once, in the cycle that read it. Whoever asked has to hear of a refusal.
  virtual void answer(const OperatorAnswer& answer) noexcept = 0;

 protected:
  ~OperatorInput() = default;
};

}  // namespace polygmap::hal
