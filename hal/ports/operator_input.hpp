// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/operator_command.hpp"

namespace polygmap::hal {

class OperatorInput {
 public:
  // The oldest command that was given and not yet read; false, and command untouched, when there is none. Never blocks.
  [[nodiscard]] virtual bool try_read(OperatorCommand& command) noexcept = 0;
  // Of the command that was read last: the module does as it was asked, or its state has no answer to it.
  virtual void answer(bool obeyed) noexcept { (void)obeyed; }

 protected:
  ~OperatorInput() = default;
};

}  // namespace polygmap::hal
