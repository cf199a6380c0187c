// SPDX-License-Identifier: Apache-2.0
// One depth frame as the stages of perception see it: raw in the driver's buffer, and reduced to columns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/image/depth_image.hpp"
#include "algorithms/perception/image/depth_range.hpp"

namespace polygmap {

// The picture as the camera delivered it, in the driver's buffer.
struct RawImage {
  const std::uint16_t* depth = nullptr;
  CameraIntrinsics intrinsics;
  RawRange range;
  [[nodiscard]] const std::uint16_t* row(std::int32_t r) const noexcept {
    return depth + static_cast<std::ptrdiff_t>(r) * intrinsics.width_px;
  }
};

struct FrameImage {
  HalfRays rays;
  HalfImage<std::uint8_t> flags;                 // of rows without body as some picture before left them
  std::array<bool, kHalfHeight_px> body_rows{};  // with body
  bool any_body = false;
  ColumnRays column_rays;
  ColumnImage columns;

  // Of a half-resolution pixel, both.
  [[nodiscard]] bool body(std::int32_t column, std::int32_t row) const noexcept {
    return body_rows[static_cast<std::size_t>(row)] && (flags(column, row) & kPixelBody) != 0;
  }
  [[nodiscard]] float inverse_depth_at(std::int32_t column, std::int32_t row) const noexcept {
    if (column < 0 || row < 0 || 2 * column / kColumn_px >= column_rays.columns || row >= rays.height_px) return 0.0F;
    const float upper = columns.inverse_depth(2 * column / kColumn_px, 2 * row);
    return upper > 0.0F ? upper : columns.inverse_depth(2 * column / kColumn_px, 2 * row + 1);
  }
};

}  // namespace polygmap
