// SPDX-License-Identifier: Apache-2.0
// A capacity of zero.
// expect: a container without room is a mistake
#include "algorithms/core/containers/ring_buffer.hpp"

#ifdef POSITIVE_CONTROL
polygmap::RingBuffer<int, 1> r;
#else
polygmap::RingBuffer<int, 0> r;
#endif
