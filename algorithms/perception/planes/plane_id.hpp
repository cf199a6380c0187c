// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace polygmap {

// The number of a plane in its frame, from 1 on. A byte: a picture has one for each of its columns' rows.
using PlaneId = std::uint8_t;
inline constexpr PlaneId kNoPlane = 0;

}  // namespace polygmap
