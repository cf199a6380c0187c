// SPDX-License-Identifier: Apache-2.0
// Sanitized and emulated programs run five to thirty times as long. There a test that repeats itself (seeds, grids of
// cases) repeats less: what those builds look for is in every repetition, and the others run all of them.
#pragma once

namespace polygmap::test {

#ifdef POLYGMAP_SLOW_MACHINE
inline constexpr bool kSlowMachine = true;
#else
inline constexpr bool kSlowMachine = false;
#endif

}  // namespace polygmap::test
