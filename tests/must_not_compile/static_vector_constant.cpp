// SPDX-License-Identifier: Apache-2.0
// What is handed on by const reference stays as it is.
// expect: (read-only location|cannot assign to return value)
#include "algorithms/core/containers/static_vector.hpp"

#ifdef POSITIVE_CONTROL
void change(polygmap::StaticVector<int, 2>& v) { v[0] = 1; }
#else
void change(const polygmap::StaticVector<int, 2>& v) { v[0] = 1; }
#endif
