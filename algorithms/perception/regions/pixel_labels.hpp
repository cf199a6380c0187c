// SPDX-License-Identifier: Apache-2.0
// Whose a single pixel is. Columns of eight pixels end a surface at one row; a tread's nosing, or else the line in
// which two planes meet, crosses those eight at an angle.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

// What a region was published as.
struct PublishedSurface {
  std::uint8_t number = 0;  // 1 + index in the frame's surfaces, 0 = it is none of them
  EdgeLine nosing;          // camera frame
};
using PublishedSurfaces = std::array<PublishedSurface, Regions::kMaxRegions + 1>;  // by RegionId

// The region of a pixel of the full picture. Without the raw picture's depths (null) columns in which two things are
// seen are nobody's.
[[nodiscard]] RegionId pixel_label(const FrameImage& image, const RawImage& raw, const DepthNoiseModel& noise,
                                   const Regions& regions, const PublishedSurfaces& published, std::int32_t column,
                                   std::int32_t row) noexcept;

}  // namespace polygmap
