// SPDX-License-Identifier: Apache-2.0
// expect: std::stable_sort
#pragma once
inline void f(int* a, int* b) noexcept { std::stable_sort(a, b); }
