// SPDX-License-Identifier: Apache-2.0
// When lost time is more than a climb goes on with. A late cycle now and then costs some millimetres, and is counted; a
// robot whose control is late again and again is not the one that the gait was proved for.
#pragma once

#include <algorithm>
#include <cstdint>

namespace polygmap {

class OverloadGuard {
 public:
  struct Params {
    std::uint32_t most_lost_cycles = 50;
    std::uint32_t recovery_cycles = 16;
    std::uint32_t most_refused = 25;

    static void visit(auto& p, auto& field) {
      field("most_lost_cycles", p.most_lost_cycles, 1, 10000,
            "The module stops when so many cycles of control were lost or overran, less one for each recovery_cycles.");
      field("recovery_cycles", p.recovery_cycles, 1, 10000, "After so many cycles in time a lost one is forgotten.");
      field("most_refused", p.most_refused, 1, 10000,
            "The module stops when the bus refused so many commands, one after the other.");
    }
  };

  // Once a cycle. lost_cycles: skipped ones, and rows or cycles that overran, all since the start.
  void count_cycle(const Params& params, std::uint32_t lost_cycles) noexcept {
    const std::uint32_t lost = lost_cycles - lost_cycles_;  // modulo 2^32
    lost_cycles_ = lost_cycles;
    short_of_ = std::min(short_of_ + std::min(lost, params.most_lost_cycles), params.most_lost_cycles);
    in_time_ = lost > 0 ? 0 : in_time_ + 1;
    if (in_time_ < params.recovery_cycles) return;
    in_time_ = 0;
    short_of_ -= std::min(short_of_, 1U);
  }
  void count_command(const Params& params, bool taken) noexcept {
    refused_ = taken ? 0 : std::min(refused_ + 1, params.most_refused);
  }
  [[nodiscard]] bool time_is_short(const Params& params) const noexcept { return short_of_ >= params.most_lost_cycles; }
  [[nodiscard]] bool commands_are_refused(const Params& params) const noexcept {
    return refused_ >= params.most_refused;
  }

 private:
  std::uint32_t lost_cycles_ = 0;  // as of the last cycle
  std::uint32_t short_of_ = 0;     // cycles lost and not forgotten
  std::uint32_t in_time_ = 0;      // cycles since the last lost one
  std::uint32_t refused_ = 0;      // commands, one after the other
};

}  // namespace polygmap
