// SPDX-License-Identifier: Apache-2.0
// Who asks the module to start, pause and stop in a simulated climb.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "firmware/supervisor.hpp"
#include "hal/ports/operator_input.hpp"

namespace polygmap::sim {

class ClimbOperator : public hal::OperatorInput {
 public:
  // Before each cycle of the module, with the state it is in.
  virtual void look(std::int64_t now_ns, ModuleState state) = 0;
  // It may still ask for something: a gait that has ended is not the end of the climb.
  [[nodiscard]] virtual bool has_more() const = 0;
  [[nodiscard]] virtual bool ends_climb() const { return false; }

 protected:
  ~ClimbOperator() = default;
};

struct TimedCommand {
  double at_s = 0.0;
  OperatorCommand command{};
};

// Each command at its time, simulated.
class ScriptedOperator final : public ClimbOperator {
 public:
  // In the order of their times.
  explicit ScriptedOperator(std::vector<TimedCommand> script) : script_(std::move(script)) {}

  void look(std::int64_t now_ns, ModuleState) override { now_ns_ = now_ns; }
  [[nodiscard]] bool has_more() const override { return next_ < script_.size(); }
  [[nodiscard]] bool try_read(OperatorCommand& command) noexcept override {
    if (next_ >= script_.size() || 1e-9 * static_cast<double>(now_ns_) < script_[next_].at_s) return false;
    command = script_[next_++].command;
    return true;
  }

 private:
  std::vector<TimedCommand> script_;
  std::size_t next_ = 0;
  std::int64_t now_ns_ = 0;
};

// As in "start@4.5"; a sentence where it is none.
[[nodiscard]] std::string read_command(const std::string& text, TimedCommand& command);

}  // namespace polygmap::sim
