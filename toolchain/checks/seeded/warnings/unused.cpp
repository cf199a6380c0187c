// SPDX-License-Identifier: Apache-2.0
// expect: Werror.*unused-parameter
int careless(int n) noexcept { return 1; }
