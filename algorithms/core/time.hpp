// SPDX-License-Identifier: Apache-2.0
// Stamps are monotonic nanoseconds; durations of the control cycle are integer ticks of 2 ms.
#pragma once

#include <cstdint>

namespace polygmap {

inline constexpr std::int64_t kNsPerMs = 1'000'000;
inline constexpr std::int64_t kNsPerS = 1'000'000'000;
[[nodiscard]] constexpr double seconds(std::int64_t duration_ns) noexcept {
  return static_cast<double>(duration_ns) * 1e-9;
}

inline constexpr double kTick_s = 0.002;  // one control cycle; no time is ever summed in floating point

}  // namespace polygmap
