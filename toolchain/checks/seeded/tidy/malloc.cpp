// SPDX-License-Identifier: Apache-2.0
// expect: cppcoreguidelines-no-malloc
#include <cstdlib>
void* careless() noexcept { return std::malloc(4); }
