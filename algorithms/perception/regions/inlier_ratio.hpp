// SPDX-License-Identifier: Apache-2.0
// Whether single pixels lie on a region that was found in columns of their means.
#pragma once

#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

// Share of the region's own pixels that lie within as many sigmas of its plane, of about kInlierSamples_px that have
// data; 1 without any. Where a pole narrower than a column stands before a wall, the columns' means lie on a plane in
// which there is nothing.
inline constexpr std::int32_t kInlierSamples_px = 64;
[[nodiscard]] double inlier_ratio(const FrameImage& image, const RawImage& raw, const DepthNoiseModel& noise,
                                  const Regions& regions, RegionId id, double sigmas) noexcept;

}  // namespace polygmap
