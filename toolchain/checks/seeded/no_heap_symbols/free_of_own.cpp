// SPDX-License-Identifier: Apache-2.0
// expect: 'malloc'
#include <cstdlib>
void careless(unsigned n, void** out) noexcept {
  std::free(*out);
  *out = std::malloc(n);
}
