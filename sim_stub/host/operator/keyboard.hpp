// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <termios.h>

#include <deque>
#include <iosfwd>
#include <optional>

#include "sim_stub/host/operator/climb_operator.hpp"

namespace polygmap::sim {

// Keys on the standard input, each a command. Whoever quits, or whose input ends, has left.
class Keyboard final : public ClimbOperator {
 public:
  explicit Keyboard(std::ostream& out);
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;
  ~Keyboard();

  [[nodiscard]] bool has_more() const override { return !has_left(); }
  [[nodiscard]] bool has_left() const override { return quits_ || (closed_ && asked_.empty()); }

 private:
  void listen() override;
  [[nodiscard]] std::optional<OperatorRequest> next() override;
  void read_keys();

  std::optional<termios> usual_;  // of a terminal, to be put back
  std::deque<OperatorCommand> asked_;
  bool closed_ = false, quits_ = false;
};

}  // namespace polygmap::sim
