// SPDX-License-Identifier: Apache-2.0
// The image as columns of eight pixels' width, at full resolution downwards: the inverse of the valid depths' mean.
// Stairs change from row to row and hardly within eight pixels of a row, over which depth errors are correlated: four
// pixels find the same edges in 1.6 times the time. (The mean of the inverses, linear on a plane, takes twice the work;
// the two differ by the square of the depths' relative spread.)
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/image/depth_image.hpp"
#include "algorithms/perception/image/depth_range.hpp"

namespace polygmap {

inline constexpr std::int32_t kColumn_px = 8;
inline constexpr std::int32_t kColumns = kDepthWidth_px / kColumn_px;

struct ColumnImage {
  Raster<float, kColumns, kDepthHeight_px> inverse_depth;  // 1/m, 0 = nothing measured, or the robot's own body
  Raster<std::uint8_t, kColumns, kDepthHeight_px> valid;   // of the column's eight pixels
  Raster<float, kDepthHeight_px, kColumns> by_column;      // inverse_depth again, a column a line: see transpose
  Raster<std::uint8_t, kDepthHeight_px, kColumns> valid_by_column;
  // Copies some rows, first a multiple of kTransposeRows, into by_column and valid_by_column.
  static constexpr std::int32_t kTransposeRows = 4;  // rows that are best copied together
  void transpose(std::int32_t first_row, std::int32_t last_row) noexcept;
};

// Rays through the columns' middles and through rows of the full image.
struct ColumnRays {
  std::array<float, kColumns> x{};
  std::array<float, kDepthHeight_px> y{};
  std::int32_t columns = 0;
  std::int32_t height_px = 0;

  void set(const CameraIntrinsics& k) noexcept {
    columns = k.width_px / kColumn_px;
    height_px = k.height_px;
    for (std::int32_t g = 0; g < columns; ++g) {
      x[static_cast<std::size_t>(g)] =
          static_cast<float>((kColumn_px * g + 0.5 * (kColumn_px - 1) - k.cx_px) / k.fx_px);
    }
    for (std::int32_t r = 0; r < height_px; ++r) {
      y[static_cast<std::size_t>(r)] = static_cast<float>((r - k.cy_px) / k.fy_px);
    }
  }
};

struct ReducedRow {
  std::int32_t measured_px = 0;
  std::int32_t body_columns = 0;
};
// One row of raw depth to one row of columns. body: half-resolution flags of that row, or null;
// what it covers does not count, and a column that it covers by more than half is empty. Works in whole vector
// registers: body and the outputs are as long as the rasters' rows, and columns beyond the image's come out empty.
// later_raw: a row that will be read soon, or null. The driver's image is in no near cache, and what the processor
// fetches by itself ends with every page of memory.
ReducedRow reduce_to_columns(const RawRange& range, const std::uint16_t* raw, const std::uint8_t* body,
                             std::int32_t columns, float* inverse_depth, std::uint8_t* valid,
                             const std::uint16_t* later_raw = nullptr) noexcept;

}  // namespace polygmap
