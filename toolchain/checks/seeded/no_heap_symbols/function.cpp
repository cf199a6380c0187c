// SPDX-License-Identifier: Apache-2.0
// expect: 'operator (new|delete).*heap
#include <functional>
std::function<int()> careless(const double (&a)[8]) noexcept {
  return [b = a[0], c = a[1], d = a[2], e = a[3]] { return static_cast<int>(b + c + d + e); };
}
