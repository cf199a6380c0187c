// SPDX-License-Identifier: Apache-2.0
// The reader reads; only the writer's back() may be written.
// expect: (read-only|cannot assign to return value)
#include "algorithms/core/containers/exchange.hpp"

void write(polygmap::Exchange<int, 3>& exchange) {
#ifdef POSITIVE_CONTROL
  exchange.back() = 1;
#else
  exchange.front() = 1;
#endif
}
