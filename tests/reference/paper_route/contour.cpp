// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/contour.hpp"

#include <algorithm>
#include <array>

namespace polygmap {
namespace {

double cross(const Vec2& a, const Vec2& b, const Vec2& c) noexcept {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

}  // namespace

bool try_trace_contour(const HalfImage<std::uint16_t>& labels, std::uint16_t label, ContourPixel first,
                       std::int32_t width_px, std::int32_t height_px, Contour& contour) noexcept {
  // Neighbours clockwise in the picture, from east.
  constexpr std::array<std::int32_t, 8> kX{1, 1, 0, -1, -1, -1, 0, 1};
  constexpr std::array<std::int32_t, 8> kY{0, 1, 1, 1, 0, -1, -1, -1};
  const auto inside = [&](std::int32_t c, std::int32_t r) {
    return c >= 0 && c < width_px && r >= 0 && r < height_px && labels(c, r) == label;
  };
  contour.clear();
  if (!inside(first.column, first.row) || !contour.try_push_back(first)) return false;
  std::int32_t column = first.column, row = first.row;
  std::size_t came_from = 4;  // west of the first pixel in row order lies outside
  std::size_t first_direction = 8;
  for (std::size_t steps = 0; steps < 2 * kMaxContour; ++steps) {
    std::size_t direction = 8;
    for (std::size_t k = 1; k <= 8; ++k) {
      const std::size_t d = (came_from + k) % 8;
      if (inside(column + kX[d], row + kY[d])) {
        direction = d;
        break;
      }
    }
    if (direction == 8) return true;  // a single pixel
    // Back at the start and about to leave as at first: the border is closed.
    if (column == first.column && row == first.row) {
      if (first_direction == 8) {
        first_direction = direction;
      } else if (direction == first_direction) {
        static_cast<void>(contour.try_pop_back());
        return true;
      }
    }
    column += kX[direction];
    row += kY[direction];
    // Search on from the last neighbour that was outside.
    came_from = (direction + (direction % 2 == 0 ? 6 : 5)) % 8;
    if (!contour.try_push_back({static_cast<std::int16_t>(column), static_cast<std::int16_t>(row)})) return false;
  }
  return false;
}

void ConvexOutline::begin() noexcept { rows_.fill(Extent{}); }

void ConvexOutline::add(const Contour& contour) noexcept {
  for (const ContourPixel& p : contour) {
    Extent& extent = rows_[static_cast<std::size_t>(p.row)];
    if (extent.last < extent.first) {
      extent = {p.column, p.column};
    } else {
      extent = {std::min(extent.first, p.column), std::max(extent.last, p.column)};
    }
  }
}

void ConvexOutline::build(std::size_t max_vertices, Outline2& outline) noexcept {
  outline.clear();
  // Right side downwards, then left side upwards: clockwise in the picture, where y points down.
  std::size_t count = 0;
  const auto push = [&](const Vec2& p, std::size_t base) {
    while (count >= base + 2 && cross(chain_[count - 2], chain_[count - 1], p) <= 0.0) --count;
    chain_[count++] = p;
  };
  std::int32_t top = 0, bottom = kHalfHeight_px - 1;
  const auto empty = [&](std::int32_t r) {
    const Extent& e = rows_[static_cast<std::size_t>(r)];
    return e.last < e.first;
  };
  while (top <= bottom && empty(top)) ++top;
  while (bottom >= top && empty(bottom)) --bottom;
  if (top > bottom) return;
  const auto corner = [&](std::int32_t boundary, bool right) {
    // The line between rows boundary - 1 and boundary: the wider of the two rows counts.
    double x = right ? -1e9 : 1e9;
    for (std::int32_t r = std::max(boundary - 1, top); r <= std::min(boundary, bottom); ++r) {
      if (empty(r)) continue;
      const Extent& e = rows_[static_cast<std::size_t>(r)];
      x = right ? std::max(x, e.last + 0.5) : std::min(x, e.first - 0.5);
    }
    return Vec2{x, boundary - 0.5};
  };
  for (std::int32_t b = top; b <= bottom + 1; ++b) {
    const Vec2 p = corner(b, true);
    if (p.x() > -1e8) push(p, 0);
  }
  const std::size_t base = count;
  for (std::int32_t b = bottom + 1; b >= top; --b) {
    const Vec2 p = corner(b, false);
    if (p.x() < 1e8) push(p, base);
  }
  // Too many corners for the outline: thin them out before the exact reduction, every removal shrinks the hull.
  while (count > kMaxOutline) {
    std::size_t least = 0;
    double least_area = 1e18;
    for (std::size_t i = 0; i < count; ++i) {
      const double area = std::abs(cross(chain_[(i + count - 1) % count], chain_[i], chain_[(i + 1) % count]));
      if (area < least_area) {
        least_area = area;
        least = i;
      }
    }
    for (std::size_t i = least; i + 1 < count; ++i) chain_[i] = chain_[i + 1];
    --count;
  }
  for (std::size_t i = 0; i < count; ++i) static_cast<void>(outline.try_push_back(chain_[i]));
  reduce(outline, max_vertices, 1e-9);
}

}  // namespace polygmap
