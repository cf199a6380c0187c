// SPDX-License-Identifier: Apache-2.0
// expect: bugprone-narrowing-conversions
int careless(double x) noexcept {
  int n = 0;
  n += x;
  return n;
}
