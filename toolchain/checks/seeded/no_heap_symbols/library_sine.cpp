// SPDX-License-Identifier: Apache-2.0
// expect: 'sinf?': the C library's, with other bits on another target.*wanted by careless
#include <cmath>
double careless(double x) noexcept { return std::sin(x); }
