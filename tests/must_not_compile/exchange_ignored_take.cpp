// SPDX-License-Identifier: Apache-2.0
// Without the answer an old value is taken for news.
// expect: nodiscard
#include "algorithms/core/containers/exchange.hpp"

int newest(polygmap::Exchange<int, 3>& exchange) {
#ifdef POSITIVE_CONTROL
  if (!exchange.try_take(0)) return -1;
#else
  exchange.try_take(0);
#endif
  return exchange.front();
}
