// SPDX-License-Identifier: Apache-2.0
// Without the answer the value may be an old one.
// expect: nodiscard
#include "algorithms/core/containers/ring_buffer.hpp"

int next(polygmap::RingBuffer<int, 2>& r) {
  int value = 0;
#ifdef POSITIVE_CONTROL
  if (!r.try_pop(value)) return -1;
#else
  r.try_pop(value);
#endif
  return value;
}
