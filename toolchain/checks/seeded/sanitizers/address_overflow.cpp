// SPDX-License-Identifier: Apache-2.0
// expect: heap-buffer-overflow
#include <vector>
int main(int argc, char**) {
  std::vector<int> v(4, argc);
  const int* volatile p = v.data();
  return p[4 * argc];
}
