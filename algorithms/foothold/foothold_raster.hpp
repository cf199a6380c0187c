// SPDX-License-Identifier: Apache-2.0
// The foothold cells around the robot, eqs (16)-(21): world-aligned, fixed size, filled row by row. A cell names its
// surface and nothing else; height, range and room for a foot follow from the surface where they are asked for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "algorithms/core/containers/raster.hpp"
#include "algorithms/foothold/level_surface.hpp"

namespace polygmap {

class FootholdRaster {
 public:
  static constexpr std::int32_t kSide = static_cast<std::int32_t>(kFootholdRasterSide_cells);
  static constexpr std::uint8_t kNoLayer = 255;

  // Cells lie on world multiples of g_res, so that they do not jitter with the pose.
  void centre_on(const Vec2& world_m, double g_res_m) noexcept {
    g_res_m_ = g_res_m;
    first_x_ = std::lround(world_m.x() / g_res_m) - kSide / 2;
    first_y_ = std::lround(world_m.y() / g_res_m) - kSide / 2;
  }
  void clear_row(std::int32_t row) noexcept { std::fill_n(cells_.row(row), kSide, kNoLayer); }

  // The part of one surface in one row: eqs (17)-(19), and the highest surface stays, eq. (21).
  void add_row(std::int32_t row, std::span<const LevelSurface> surfaces, std::uint8_t layer) noexcept {
    const LevelSurface& surface = surfaces[layer];
    const double y_m = at(0, row).y();
    if (y_m < surface.box.min_m.y() || y_m > surface.box.max_m.y()) return;  // eq. (16)
    Interval x;
    if (!row_interval(surface.hull, y_m, x)) return;  // eq. (17)
    const double limit = static_cast<double>(kSide);
    const double first = math::clamp(std::ceil(x.min_m / g_res_m_ - static_cast<double>(first_x_)), 0.0, limit);
    const double last = math::clamp(std::floor(x.max_m / g_res_m_ - static_cast<double>(first_x_)), -1.0, limit - 1.0);
    for (auto column = static_cast<std::int32_t>(first); column <= static_cast<std::int32_t>(last); ++column) {
      std::uint8_t& cell = cells_(column, row);
      // Eq. (18) takes the mean of the vertices; the plane's own height is the same on a level surface and right on a
      // tilted one (a floor tilted by 5 mrad is 5 mm off at 1 m).
      const auto height_m = [&](std::uint8_t i) { return surfaces[i].plane.height_m(at(column, row)); };
      if (cell == kNoLayer || height_m(layer) > height_m(cell)) cell = layer;
    }
  }

  // The columns of a row at which a quantity that grows by `step` a column, from `first` at column 0, may lie within an
  // interval: two more at either end, for the rounding. The caller still asks every cell.
  struct Columns {
    std::int32_t begin = 0, end = kSide;
    [[nodiscard]] Columns operator&(const Columns& other) const noexcept {
      return {std::max(begin, other.begin), std::min(end, other.end)};
    }
  };
  [[nodiscard]] static Columns columns_within(double first, double step, const Interval& within) noexcept {
    if (std::abs(step) * kSide < 1e-6) {
      return first < within.min_m - 1e-6 || first > within.max_m + 1e-6 ? Columns{0, 0} : Columns{};
    }
    const double a = (within.min_m - first) / step, b = (within.max_m - first) / step;
    constexpr double kLimit = kSide;
    return {static_cast<std::int32_t>(math::clamp(std::min(a, b) - 2.0, 0.0, kLimit)),
            static_cast<std::int32_t>(math::clamp(std::max(a, b) + 3.0, 0.0, kLimit))};
  }

  [[nodiscard]] Vec2 at(std::int32_t column, std::int32_t row) const noexcept {
    return {g_res_m_ * static_cast<double>(first_x_ + column), g_res_m_ * static_cast<double>(first_y_ + row)};
  }
  // Index of the surface: one layer per mapped surface, eq. (24).
  [[nodiscard]] std::uint8_t layer(std::int32_t column, std::int32_t row) const noexcept { return cells_(column, row); }

 private:
  Raster<std::uint8_t, kSide, kSide> cells_;
  double g_res_m_ = 0.01;
  long first_x_ = 0;
  long first_y_ = 0;
};

}  // namespace polygmap
