// SPDX-License-Identifier: Apache-2.0
// The outer border of a labelled region, and the convex outline of one or several borders in the picture.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/perception/image/depth_image.hpp"
#include "algorithms/perception/polygons/convex_outline.hpp"

namespace polygmap {

struct ContourPixel {
  std::int16_t column = 0;
  std::int16_t row = 0;
};
inline constexpr std::size_t kMaxContour = 4096;
using Contour = StaticVector<ContourPixel, kMaxContour>;

// Traces the 8-connected outer border clockwise (in the picture), starting at the region's first pixel in row order.
// False when the contour found no room: it then holds the part that did.
[[nodiscard]] bool try_trace_contour(const HalfImage<std::uint16_t>& labels, std::uint16_t label, ContourPixel first,
                                     std::int32_t width_px, std::int32_t height_px, Contour& contour) noexcept;

// Grows with contours; the convex outline follows without sorting because rows are already in order.
class ConvexOutline {
 public:
  void begin() noexcept;
  void add(const Contour& contour) noexcept;
  // Corner points (half-resolution pixel coordinates, x right, y down) of the hull of all pixel squares, in the order
  // right-hand turns in the picture (clockwise as seen), at most max_vertices: the corners that cost least area go
  // first.
  void build(std::size_t max_vertices, Outline2& outline) noexcept;

 private:
  struct Extent {
    std::int16_t first = 1;
    std::int16_t last = 0;
  };
  std::array<Extent, kHalfHeight_px> rows_{};
  std::array<Vec2, 2 * kHalfHeight_px + 4> chain_{};
};

}  // namespace polygmap
