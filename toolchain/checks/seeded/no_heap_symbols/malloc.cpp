// SPDX-License-Identifier: Apache-2.0
// expect: 'malloc'.*heap; wanted by careless
#include <cstdlib>
void* careless(unsigned n) noexcept { return std::malloc(n); }
