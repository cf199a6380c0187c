// SPDX-License-Identifier: Apache-2.0
// expect: 'operator new.*heap; wanted by .*careless
#include <vector>
int careless(int n) noexcept {
  std::vector<int> v(static_cast<std::size_t>(n));
  return v.data()[n - 1];
}
