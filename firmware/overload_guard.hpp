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
    std::uint32_t most_late_cycles = 50;
    std::uint32_t recovery_cycles = 16;
    std::uint32_t most_refused = 25;

    static void visit(auto& p, auto& field) {
      field("most_late_cycles", p.most_late_cycles, 1, 10000,
            "The module stops when so many of control's cycles were late, less one for each recovery_cycles.");
      field("recovery_cycles", p.recovery_cycles, 1, 10000, "After so many cycles in time a late one is forgotten.");
      field("most_refused", p.most_refused, 1, 10000,
            "The module stops when so many commands were refused or not finite, one after the other.");
    }
  };

  // Once a cycle of control. late: those skipped before it, and one when itself was late.
  void count_cycle(const Params& params, std::uint64_t late) noexcept {
    const auto more = static_cast<std::uint32_t>(std::min<std::uint64_t>(late, params.most_late_cycles));
    short_of_ = std::min(short_of_ + more, params.most_late_cycles);
    in_time_ = late > 0 ? 0 : in_time_ + 1;
    if (in_time_ < params.recovery_cycles) return;
    in_time_ = 0;
    short_of_ -= std::min(short_of_, 1U);
  }
  void count_command(const Params& params, bool taken) noexcept {
    refused_ = taken ? 0 : std::min(refused_ + 1, params.most_refused);
  }
  [[nodiscard]] bool takes_commands() const noexcept { return refused_ == 0; }  // the last one was taken
  [[nodiscard]] bool time_is_short(const Params& params) const noexcept { return short_of_ >= params.most_late_cycles; }
  [[nodiscard]] bool commands_are_refused(const Params& params) const noexcept {
    return refused_ >= params.most_refused;
  }

 private:
  std::uint32_t short_of_ = 0;  // late cycles that are not forgotten
  std::uint32_t in_time_ = 0;   // cycles since the last late one
  std::uint32_t refused_ = 0;   // commands, one after the other
};

}  // namespace polygmap
