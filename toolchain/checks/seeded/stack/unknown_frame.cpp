// SPDX-License-Identifier: Apache-2.0
// expect: frame of unknown size
int sum(int* values, int n) noexcept;
int careless(int n) noexcept {
  auto* values = static_cast<int*>(__builtin_alloca(static_cast<unsigned>(n) * sizeof(int)));
  return sum(values, n);
}
