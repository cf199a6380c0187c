// SPDX-License-Identifier: Apache-2.0
// expect: '__assert_fail'
#undef NDEBUG
#include <cassert>
int careless(int n) noexcept {
  assert(n > 0);
  return n;
}
