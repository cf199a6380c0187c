// SPDX-License-Identifier: Apache-2.0
// A refused value must not go unnoticed; push_overwrite() says that the oldest may go.
// expect: nodiscard
#include "algorithms/core/containers/ring_buffer.hpp"

void append(polygmap::RingBuffer<int, 2>& r) {
#ifdef POSITIVE_CONTROL
  r.push_overwrite(1);
#else
  r.try_push(1);
#endif
}
