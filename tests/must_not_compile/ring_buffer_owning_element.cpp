// SPDX-License-Identifier: Apache-2.0
// Elements are overwritten: one that owns something would leak.
// expect: never destroyed one by one
#include "algorithms/core/containers/ring_buffer.hpp"

struct Element {
#ifndef POSITIVE_CONTROL
  ~Element() {}
#endif
};
polygmap::RingBuffer<Element, 2> r;
