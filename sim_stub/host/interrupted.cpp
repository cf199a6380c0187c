// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/interrupted.hpp"

namespace polygmap::sim {

void throw_if_interrupted(const std::atomic<int>* interrupt) {
  const int signal = interrupt != nullptr ? interrupt->load() : 0;
  if (signal != 0) throw Interrupted{signal};
}

}  // namespace polygmap::sim
