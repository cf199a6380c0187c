// SPDX-License-Identifier: Apache-2.0
// expect: std::sin\('
#pragma once
inline double f(double x) noexcept { return std::sin(x); }
