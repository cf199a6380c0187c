// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <cerrno>
#include <cstdint>

#include "algorithms/core/time.hpp"

namespace polygmap::daemon {

// CLOCK_MONOTONIC, which the daemon's own threads wait by. The lanes read hal/linux/system/posix_clock.hpp.
[[nodiscard]] inline std::int64_t monotonic_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}
inline void sleep_until(std::int64_t due_ns) noexcept {
  const timespec due{due_ns / kNsPerS, due_ns % kNsPerS};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
  }
}

}  // namespace polygmap::daemon
