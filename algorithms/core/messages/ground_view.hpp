// SPDX-License-Identifier: Apache-2.0
// The ground about the robot as pictures showed it, in squares along the axes of odometry.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

struct GroundView {
  static constexpr std::int32_t kSide_cells = 64;  // 2.56 m
  static constexpr double kCell_m = 0.04;
  using Rows = std::array<std::uint64_t, kSide_cells>;  // bit x of row y

  Vec2 corner_m = Vec2::Zero();  // where x and y of cell (0, 0) begin
  double height_m = 0.0;         // of the standing soles, as they stood for it
  // Ground at the height of the standing soles was seen there, or a sole has stood there, and no mapped slope is near.
  Rows level{};
  Rows tall{};            // something rises there
  Rows ramps{};           // a mapped surface that is too steep to walk on, and longer than any tread, is there
  double steepest = 0.0;  // of those in view: by what it rises over a metre

  [[nodiscard]] static std::int32_t cell_of(double along_m) noexcept {
    return static_cast<std::int32_t>(std::floor(along_m / kCell_m));
  }
  // False outside the view.
  [[nodiscard]] static bool has(const Rows& rows, std::int32_t x, std::int32_t y) noexcept {
    if (x < 0 || y < 0 || x >= kSide_cells || y >= kSide_cells) return false;
    return (rows[static_cast<std::size_t>(y)] >> static_cast<std::uint32_t>(x) & 1U) != 0;
  }
  // Bits first_x to last_x of a row, as far as they are in the view.
  [[nodiscard]] static std::uint64_t bits_of(std::int32_t first_x, std::int32_t last_x) noexcept {
    const std::int32_t first = std::max(first_x, 0), last = std::min(last_x, kSide_cells - 1);
    if (first > last) return 0;
    return ~std::uint64_t{0} >> static_cast<std::uint32_t>(kSide_cells - 1 - last + first)
                                    << static_cast<std::uint32_t>(first);
  }
};

}  // namespace polygmap
