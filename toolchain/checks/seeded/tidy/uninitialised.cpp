// SPDX-License-Identifier: Apache-2.0
// expect: cppcoreguidelines-init-variables
int careless(bool b) noexcept {
  int x;
  if (b) x = 1;
  return b ? x : 0;
}
