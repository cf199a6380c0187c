// SPDX-License-Identifier: Apache-2.0
// expect: 'std::__throw_out_of_range_fmt.*exceptions
#include <array>
int careless(const std::array<int, 4>& a, unsigned i) { return a.at(i); }
