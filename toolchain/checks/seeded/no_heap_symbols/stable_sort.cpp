// SPDX-License-Identifier: Apache-2.0
// expect: 'operator new.*heap
#include <algorithm>
void careless(int* first, int* last) noexcept { std::stable_sort(first, last); }
