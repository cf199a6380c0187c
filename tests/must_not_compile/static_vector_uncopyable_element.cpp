// SPDX-License-Identifier: Apache-2.0
// Elements are values: one that cannot be copied has no place in an array of them.
// expect: they need a default constructor and copy
#include "algorithms/core/containers/static_vector.hpp"

struct Element {
#ifndef POSITIVE_CONTROL
  Element() = default;
  Element(const Element&) = delete;
  Element& operator=(const Element&) = delete;
#endif
};
polygmap::StaticVector<Element, 2> v;
