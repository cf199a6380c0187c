// SPDX-License-Identifier: Apache-2.0
// The foothold cells around the robot, eqs (16)-(21): aligned with odometry, fixed size, filled row by row. A cell
// names its surface and nothing else; height, range and room for a foot follow from the surface where they are asked
// for.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>

#include "algorithms/core/containers/raster.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/foothold/level_surface.hpp"

namespace polygmap {

class FootholdRaster {
 public:
  static constexpr std::int32_t kSide = static_cast<std::int32_t>(kFootholdRasterSide_cells);
  static constexpr std::uint8_t kNoLayer = 255;

  // Cells lie on multiples of g_res, so that they do not jitter with the pose.
  void centre_on(const Vec2& p_m, double g_res_m) noexcept {
    g_res_m_ = g_res_m;
    first_x_ = std::lround(p_m.x() / g_res_m) - kSide / 2;
    first_y_ = std::lround(p_m.y() / g_res_m) - kSide / 2;
  }
  void clear_row(std::int32_t row) noexcept { std::fill_n(cells_.row(row), kSide, kNoLayer); }

  // The part of one surface in one row: eqs (17)-(19), and the highest surface stays, eq. (21).
  // Along a row two planes differ linearly: what their ends say holds between them.
  void add_row(std::int32_t row, std::span<const LevelSurface> surfaces, std::uint8_t layer) noexcept {
    const LevelSurface& surface = surfaces[layer];
    const double y_m = at(0, row).y();
    work_.add(22);
    if (y_m < surface.box.min_m.y() || y_m > surface.box.max_m.y()) return;  // eq. (16)
    work_.add(150);
    work_.add(surface.hull.size(), 22);
    Interval x;
    if (!row_interval(surface.hull, y_m, x)) return;  // eq. (17)
    const double limit = static_cast<double>(kSide);
    const double first = math::clamp(std::ceil(x.min_m / g_res_m_ - static_cast<double>(first_x_)), 0.0, limit);
    const double last = math::clamp(std::floor(x.max_m / g_res_m_ - static_cast<double>(first_x_)), -1.0, limit - 1.0);
    const auto end = static_cast<std::int32_t>(last) + 1;
    for (auto begin = static_cast<std::int32_t>(first); begin < end;) {
      const Stretch here = stretch(row, begin, end);
      work_.add(60 + (here.end - begin) / 2);
      add_stretch(row, here, surfaces, layer);
      begin = here.end;
    }
  }

  // Cells next to each other in a row that one layer has, or none.
  struct Stretch {
    std::uint8_t layer = kNoLayer;
    std::int32_t begin = 0, end = 0;
  };
  // The one that begins at a column, as far as `end`.
  [[nodiscard]] Stretch stretch(std::int32_t row, std::int32_t begin, std::int32_t end) const noexcept {
    constexpr std::int32_t kAtOnce = 8;
    static_assert(kAtOnce == sizeof(std::uint64_t) && std::endian::native == std::endian::little);
    const std::uint8_t* cells = cells_.row(row);
    const std::uint64_t wanted = cells[begin] * 0x0101010101010101U;
    std::int32_t at = begin;
    for (; at + kAtOnce <= end; at += kAtOnce) {
      std::uint64_t eight = 0;
      std::memcpy(&eight, cells + at, sizeof(eight));
      if (eight != wanted) return {cells[begin], begin, at + std::countr_zero(eight ^ wanted) / 8};
    }
    while (at < end && cells[at] == cells[begin]) ++at;
    return {cells[begin], begin, at};
  }
  // Whether a surface is higher than a height all along a stretch, or nowhere; neither where it crosses it, or nearly.
  enum class Rises : std::uint8_t { kNowhere, kSomewhere, kEverywhere };
  [[nodiscard]] Rises rises(std::int32_t row, const Stretch& stretch, const Plane& plane,
                            double above_m) const noexcept {
    return rises(plane.height_m(at(stretch.begin, row)) - above_m, plane.height_m(at(stretch.end - 1, row)) - above_m);
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
  // About where along a row a point lies.
  [[nodiscard]] std::int32_t column_of(double x_m) const noexcept {
    return static_cast<std::int32_t>(math::clamp(x_m / g_res_m_ - static_cast<double>(first_x_), -1.0, kSide));
  }
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid
  // Index of the surface: one layer per mapped surface, eq. (24).
  [[nodiscard]] std::uint8_t layer(std::int32_t column, std::int32_t row) const noexcept { return cells_(column, row); }

 private:
  // of a quantity that is linear between its values at both ends
  [[nodiscard]] static Rises rises(double at_begin, double at_end) noexcept {
    constexpr double kRounding = 1e-9;
    if (at_begin < -kRounding && at_end < -kRounding) return Rises::kNowhere;
    return at_begin > kRounding && at_end > kRounding ? Rises::kEverywhere : Rises::kSomewhere;
  }
  // Eq. (18) takes the mean of the vertices; the plane's own height is the same on a level surface and right on a
  // tilted one (a floor tilted by 5 mrad is 5 mm off at 1 m).
  void add_stretch(std::int32_t row, const Stretch& stretch, std::span<const LevelSurface> surfaces,
                   std::uint8_t layer) noexcept {
    std::uint8_t* cells = cells_.row(row);
    const auto above_m = [&](std::int32_t column) {
      const Vec2 p = at(column, row);
      return surfaces[layer].plane.height_m(p) - surfaces[stretch.layer].plane.height_m(p);
    };
    if (stretch.layer != kNoLayer) work_.add(45);
    const Rises higher =
        stretch.layer == kNoLayer ? Rises::kEverywhere : rises(above_m(stretch.begin), above_m(stretch.end - 1));
    if (higher == Rises::kEverywhere) std::fill(cells + stretch.begin, cells + stretch.end, layer);
    if (higher != Rises::kSomewhere) return;
    work_.add(stretch.end - stretch.begin, 34);
    for (std::int32_t column = stretch.begin; column < stretch.end; ++column) {
      const Vec2 p = at(column, row);
      if (surfaces[layer].plane.height_m(p) > surfaces[stretch.layer].plane.height_m(p)) cells[column] = layer;
    }
  }

  Raster<std::uint8_t, kSide, kSide> cells_;
  WorkCount work_;
  double g_res_m_ = 0.01;
  long first_x_ = 0;
  long first_y_ = 0;
};

}  // namespace polygmap
