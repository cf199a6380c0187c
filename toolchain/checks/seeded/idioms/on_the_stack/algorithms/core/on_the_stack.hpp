// SPDX-License-Identifier: Apache-2.0
// expect: alloca
#pragma once
inline void* f(unsigned n) noexcept { return alloca(n); }
