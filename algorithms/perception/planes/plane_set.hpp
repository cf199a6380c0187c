// SPDX-License-Identifier: Apache-2.0
// What is known of one frame: its picture as the stages see it, and the planes in it.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/image/depth_image.hpp"
#include "algorithms/perception/image/depth_range.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

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

struct FramePlane {
  InversePlane plane;
  SurfaceKind kind = SurfaceKind::kOther;
  Vec3 centre_m = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();
  PlaneMoments moments;
  double residual2 = 0.0;  // sum of squared normal distances of the fitted pixels
  double pixels = 0.0;
  bool alive = false;
  bool facet = false;        // too small to be a plane by itself
  std::uint8_t facets = 1;   // planes that were joined into this one
  bool low_parts = false;    // among them some that are too low to say how they lean
  std::uint8_t surface = 0;  // 1 + index in the result
  std::uint8_t source = 0;   // the plane whose pixels these are
  std::uint8_t same = 0;     // the first surface of those that count as one plane
  std::uint16_t main_piece = 0;
  double piece_px = 0.0;
  EdgeLine nosing;  // of a surface, camera frame
};

struct PlaneSet {  // 1-based
  static constexpr std::size_t kMaxPlanes = SpanBoundaries::kMaxPlanes;
  std::array<FramePlane, kMaxPlanes + 1> planes;
  std::size_t count = 0;

  [[nodiscard]] FramePlane& operator[](std::size_t i) noexcept { return planes[i]; }
  [[nodiscard]] const FramePlane& operator[](std::size_t i) const noexcept { return planes[i]; }
};

struct FrameImage {
  HalfRays rays;
  HalfImage<std::uint8_t> flags;                 // of rows without body as some picture before left them
  std::array<bool, kHalfHeight_px> body_rows{};  // with body
  bool any_body = false;
  ColumnRays column_rays;
  ColumnImage columns;
  Raster<std::uint8_t, kDepthHeight_px, kColumns> owners;  // a column a line: the plane of each of its rows, 0 = none

  [[nodiscard]] std::uint8_t owner(std::int32_t column, std::int32_t row) const noexcept { return owners(row, column); }
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
