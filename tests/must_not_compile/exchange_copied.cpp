// SPDX-License-Identifier: Apache-2.0
// Two threads hold references into it.
// expect: deleted
#include "algorithms/core/containers/exchange.hpp"

int newest(const polygmap::Exchange<int, 3>& exchange) {
#ifdef POSITIVE_CONTROL
  const auto& same = exchange;
#else
  const auto same = exchange;
#endif
  return same.front();
}
