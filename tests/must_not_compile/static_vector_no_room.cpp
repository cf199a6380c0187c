// SPDX-License-Identifier: Apache-2.0
// A capacity of zero.
// expect: a container without room is a mistake
#include "algorithms/core/containers/static_vector.hpp"

#ifdef POSITIVE_CONTROL
polygmap::StaticVector<int, 1> v;
#else
polygmap::StaticVector<int, 0> v;
#endif
