// SPDX-License-Identifier: Apache-2.0
// expect: misc-no-recursion
int careless(int n) noexcept { return n < 2 ? 1 : n * careless(n - 1); }
