// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

namespace polygmap::bench {

// Of this thread on its core: what other programs on the machine take is no property of a stage.
[[nodiscard]] inline double cpu_seconds() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace polygmap::bench
