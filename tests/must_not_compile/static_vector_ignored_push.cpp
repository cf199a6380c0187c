// SPDX-License-Identifier: Apache-2.0
// Full is an answer: ignoring it loses data silently.
// expect: nodiscard
#include "algorithms/core/containers/static_vector.hpp"

void append(polygmap::StaticVector<int, 2>& v) {
#ifdef POSITIVE_CONTROL
  if (!v.try_push_back(1)) v.clear();
#else
  v.try_push_back(1);
#endif
}
