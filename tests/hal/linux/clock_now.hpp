// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ctime>

namespace polygmap::test {

[[nodiscard]] inline std::int64_t monotonic_now_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

// An age that a stamp of the machine's start is beyond and that no test takes, be the machine ever so busy.
[[nodiscard]] inline std::int64_t half_of_uptime_ns() { return monotonic_now_ns() / 2; }

}  // namespace polygmap::test
