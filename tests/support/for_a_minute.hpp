// SPDX-License-Identifier: Apache-2.0
// Random tests that run for a time, whatever the machine.
#pragma once

#include <chrono>

namespace polygmap::test {

// try_seed(unsigned) with one seed after the other until a minute is over; at least once.
template <typename TrySeed>
void for_a_minute(unsigned first_seed, TrySeed&& try_seed) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  unsigned seed = first_seed;
  do {
    try_seed(seed++);
  } while (std::chrono::steady_clock::now() < end);
}

}  // namespace polygmap::test
