// SPDX-License-Identifier: Apache-2.0
// Whether single pixels lie on a surface that was found in columns of their means.
#pragma once

#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/regions/column_extents.hpp"

namespace polygmap {

// Share of the surface's own pixels that lie on its plane, of about kEvidence_px that have data; 1 without any. Where a
// pole narrower than a column stands before a wall, the columns' means lie on a plane in which there is nothing.
inline constexpr std::int32_t kEvidence_px = 64;
[[nodiscard]] double inlier_ratio(const FrameImage& picture, const RawImage& raw, const DepthNoiseModel& noise,
                                  const FramePlane& plane, std::size_t index, const ColumnExtents& profile) noexcept;

}  // namespace polygmap
