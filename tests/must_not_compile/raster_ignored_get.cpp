// SPDX-License-Identifier: Apache-2.0
// Outside the grid there is no value.
// expect: nodiscard
#include "algorithms/core/containers/raster.hpp"

int at(const polygmap::Raster<int, 2, 2>& r) {
  int value = 0;
#ifdef POSITIVE_CONTROL
  if (!r.try_get(2, 2, value)) return -1;
#else
  r.try_get(2, 2, value);
#endif
  return value;
}
