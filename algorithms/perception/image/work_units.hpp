// SPDX-License-Identifier: Apache-2.0
// The unit in which the stages of a frame count their work.
#pragma once

#include <cstdint>

namespace polygmap {

// One unit is a row of 80 columns through reduction and segmentation, or as much work (its cost:
// firmware/schedule.hpp).
inline constexpr std::int32_t kRowUnits = 1;
// One of the passes over spans takes a column of 480 rows as long at most: it looks at the spans' ends alone.
inline constexpr std::int32_t kColumnUnits = 1;
// No piece of work is larger. What happens a few times in a frame counts as much, whatever it takes.
inline constexpr std::int32_t kMaxPieceUnits = 40;

}  // namespace polygmap
