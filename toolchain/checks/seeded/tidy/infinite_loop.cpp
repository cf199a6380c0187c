// SPDX-License-Identifier: Apache-2.0
// expect: bugprone-infinite-loop
int careless(int n) noexcept {
  int i = 0;
  while (i < n) {
  }
  return i;
}
