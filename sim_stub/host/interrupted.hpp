// SPDX-License-Identifier: Apache-2.0
// SIGINT and SIGTERM, as a command that writes its files at the end meets them.
#pragma once

#include <atomic>

namespace polygmap::sim {

// Thrown where a command stops before its files are written.
struct Interrupted {
  int signal;
};

// interrupt: what a signal handler sets to the signal's number; null where there is none.
void throw_if_interrupted(const std::atomic<int>* interrupt);

}  // namespace polygmap::sim
