// SPDX-License-Identifier: Apache-2.0
// The convex outline of a surface from where it begins and ends in each column of the picture.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "algorithms/perception/column_image.hpp"
#include "algorithms/perception/outline.hpp"

namespace polygmap {

struct ColumnEnds {
  std::int16_t top = -1;  // full-resolution rows, inclusive; -1 = the surface is not in this column
  std::int16_t bottom = -1;
  [[nodiscard]] bool empty() const noexcept { return top < 0; }
  void add(std::int16_t first, std::int16_t last) noexcept {
    top = empty() || first < top ? first : top;
    bottom = last > bottom ? last : bottom;
  }
};

struct SurfaceProfile {
  std::array<ColumnEnds, kColumns> columns{};
  std::int16_t first_row = kDepthHeight_px;
  std::int16_t last_row = -1;
  std::int16_t first_column = kColumns;
  std::int16_t last_column = -1;
  void add(std::int32_t column, std::int16_t top, std::int16_t bottom) noexcept {
    columns[static_cast<std::size_t>(column)].add(top, bottom);
    first_row = std::min(first_row, top);
    last_row = std::max(last_row, bottom);
    first_column = std::min(first_column, static_cast<std::int16_t>(column));
    last_column = std::max(last_column, static_cast<std::int16_t>(column));
  }
};

// The line that ends a surface at its left or right: column = column_px + slope * row, half-resolution pixels. Not
// fitted: upright, as far as the surface's columns reach.
struct OutlineSide {
  double column_px = 0.0;
  double slope = 0.0;
  double top_px = 0.0;  // rows between which it was seen
  double bottom_px = 0.0;
  bool fitted = false;
  [[nodiscard]] double at(double row) const noexcept { return column_px + slope * row; }
};
struct OutlineSides {
  OutlineSide left;
  OutlineSide right;
};

class ColumnOutline {
 public:
  // Corner points in half-resolution pixel coordinates (x right, y down), right-hand turns in the picture (clockwise as
  // seen), at most max_vertices: the corners that cost least area go first.
  void build(const SurfaceProfile& profile, const OutlineSides& sides, std::size_t max_vertices,
             Outline2& outline) noexcept;

 private:
  std::array<Vec2, 2 * (kColumns + 2)> chain_{};
  std::array<ColumnEnds, kColumns> smooth_{};
};

}  // namespace polygmap
