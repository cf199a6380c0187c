// SPDX-License-Identifier: Apache-2.0
// expect: recursion:
int odd(int* a, int n) noexcept;
__attribute__((noinline)) int even(int* a, int n) noexcept { return n == 0 ? 1 : odd(a, n - 1) - a[n]; }
__attribute__((noinline)) int odd(int* a, int n) noexcept { return n == 0 ? 0 : even(a, n - 1) + a[n]; }
