// SPDX-License-Identifier: Apache-2.0
// expect: modernize-avoid-c-arrays
int careless(int i) noexcept {
  const int values[3] = {1, 2, 3};
  return values[i];
}
