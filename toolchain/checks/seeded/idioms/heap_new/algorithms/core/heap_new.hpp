// SPDX-License-Identifier: Apache-2.0
// expect: 'new'
#pragma once
inline int* f() noexcept { return new int(1); }
