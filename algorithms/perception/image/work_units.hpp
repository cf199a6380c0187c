// SPDX-License-Identifier: Apache-2.0
// The largest piece of work of a frame.
#pragma once

#include <cstdint>

#include "algorithms/core/work.hpp"

namespace polygmap {

// In units. Not every piece of the worst picture was seen: what is larger is paid all the same, in the slots after it.
inline constexpr std::int32_t kMaxPieceUnits = 120'000 / kInstructionsPerUnit;

}  // namespace polygmap
