// SPDX-License-Identifier: Apache-2.0
// The convex outline of a surface from where it begins and ends in each column of the picture.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/polygons/convex_outline.hpp"
#include "algorithms/perception/regions/column_extents.hpp"

namespace polygmap {

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
  // seen), at most max_vertices: the corners that cost least area go first. corner_px: a side that was seen to end as
  // near to the columns beside it ends at the corner with them.
  void build(const ColumnExtents& profile, const OutlineSides& sides, double corner_px, std::size_t max_vertices,
             Outline2& outline) noexcept;
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  void push(const Vec2& p, std::size_t base) noexcept;
  void thin() noexcept;

  std::array<Vec2, 2 * (kColumns + 2)> chain_{};
  std::size_t count_ = 0;  // corners in chain_
  std::array<ColumnExtent, kColumns> smooth_{};
  WorkCount work_;
};

}  // namespace polygmap
