// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace polygmap::hal {

// Monotonic time and a free-running counter. Virtual in simulation and replay.
class Clock {
 public:
  // Never goes back.
  [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
  // Counts up at any constant rate and may wrap around; differences measure work. counts_per_us() gives the rate, 1 to
  // 10000.
  [[nodiscard]] virtual std::uint64_t count() const noexcept = 0;
  [[nodiscard]] virtual double counts_per_us() const noexcept = 0;

 protected:
  ~Clock() = default;
};

}  // namespace polygmap::hal
