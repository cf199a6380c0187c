// SPDX-License-Identifier: Apache-2.0
// Whose a single pixel is. Columns of eight pixels end a surface at one row; a tread's nosing, or else the line in
// which two planes meet, crosses those eight at an angle.
#pragma once

#include <cstddef>
#include <cstdint>

#include "algorithms/perception/planes/plane_set.hpp"

namespace polygmap {

// The plane of a pixel of the full picture, 0 = none. Without the raw picture's depths (null) columns in which two
// things are seen are nobody's.
[[nodiscard]] std::size_t pixel_label(const FrameImage& picture, const RawImage& raw, const DepthNoiseModel& noise,
                                      const PlaneSet& planes, std::int32_t column, std::int32_t row) noexcept;

}  // namespace polygmap
