// SPDX-License-Identifier: Apache-2.0
// Elements are overwritten: one that owns something would leak.
// expect: never destroyed one by one
#include "algorithms/core/containers/static_vector.hpp"

struct Element {
#ifndef POSITIVE_CONTROL
  ~Element() {}
#endif
};
polygmap::StaticVector<Element, 2> v;
