// SPDX-License-Identifier: Apache-2.0
// Where a region begins and ends in the picture's columns.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "algorithms/perception/image/column_image.hpp"

namespace polygmap {

struct ColumnExtent {
  std::int16_t top = -1;  // full-resolution rows, inclusive; -1 = the region is not in this column
  std::int16_t bottom = -1;
  [[nodiscard]] bool empty() const noexcept { return top < 0; }
  void add(std::int16_t first, std::int16_t last) noexcept {
    top = empty() || first < top ? first : top;
    bottom = last > bottom ? last : bottom;
  }
};

struct ColumnExtents {
  std::array<ColumnExtent, kColumns> columns{};
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

}  // namespace polygmap
