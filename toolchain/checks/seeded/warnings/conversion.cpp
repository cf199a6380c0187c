// SPDX-License-Identifier: Apache-2.0
// expect: Werror.*(conversion|shorten-64-to-32)
int careless(long n) noexcept { return n; }
