// SPDX-License-Identifier: Apache-2.0
// expect: Werror.*shadow
int careless(int n) noexcept {
  int m = n;
  {
    int n = 2;
    m += n;
  }
  return m;
}
