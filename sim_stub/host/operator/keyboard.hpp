// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <termios.h>

#include <chrono>
#include <deque>
#include <iosfwd>
#include <optional>

#include "sim_stub/host/operator/climb_operator.hpp"

namespace polygmap::sim {

// Keys on the standard input, each a command, and the climb no faster than the wall's clock. What it hears and the
// module's states are said on a stream.
class Keyboard final : public ClimbOperator {
 public:
  explicit Keyboard(std::ostream& out);
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;
  ~Keyboard();

  void look(std::int64_t now_ns, ModuleState state) override;
  [[nodiscard]] bool has_more() const override { return !closed_ || !asked_.empty(); }
  [[nodiscard]] bool ends_climb() const override { return quits_; }
  [[nodiscard]] bool try_read(OperatorCommand& command) noexcept override;

 private:
  void read_keys();

  std::ostream& out_;
  std::optional<termios> usual_;  // of a terminal, to be put back
  std::deque<OperatorCommand> asked_;
  bool closed_ = false, quits_ = false;
  std::optional<ModuleState> state_;
  std::int64_t begun_ns_ = -1;
  std::chrono::steady_clock::time_point begun_;
};

}  // namespace polygmap::sim
