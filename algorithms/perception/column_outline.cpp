// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/column_outline.hpp"

#include <algorithm>

namespace polygmap {
namespace {

std::int16_t median(std::int16_t a, std::int16_t b, std::int16_t c, std::int16_t d, std::int16_t e) noexcept {
  const auto low = [](std::int16_t x, std::int16_t y) { return x < y ? x : y; };
  const auto high = [](std::int16_t x, std::int16_t y) { return x < y ? y : x; };
  // Neither the least nor the largest of four is the median of five; of the other two and the fifth it is the middle.
  const std::int16_t f = high(low(a, b), low(c, d));
  const std::int16_t g = low(high(a, b), high(c, d));
  return high(low(f, g), low(high(f, g), e));
}

// A hull follows its outermost points, and with them the noise: the median of five columns, where there are five.
void smooth(const SurfaceProfile& profile, std::int32_t first, std::int32_t last,
            std::array<ColumnEnds, kColumns>& smoothed) noexcept {
  for (std::int32_t g = first; g <= last; ++g) {
    const ColumnEnds* ends = &profile.columns[static_cast<std::size_t>(g)];
    ColumnEnds& out = smoothed[static_cast<std::size_t>(g)];
    out = *ends;
    if (g < first + 2 || g > last - 2) continue;
    if ((ends[-2].top | ends[-1].top | ends[0].top | ends[1].top | ends[2].top) < 0) continue;
    out.top = median(ends[-2].top, ends[-1].top, ends[0].top, ends[1].top, ends[2].top);
    out.bottom = median(ends[-2].bottom, ends[-1].bottom, ends[0].bottom, ends[1].bottom, ends[2].bottom);
  }
}

}  // namespace

void ColumnOutline::build(const SurfaceProfile& profile, const OutlineSides& sides, std::size_t max_vertices,
                          Outline2& outline) noexcept {
  outline.clear();
  const std::int32_t first = profile.first_column, last = profile.last_column;
  const auto ends = [&profile](std::int32_t g) { return profile.columns[static_cast<std::size_t>(g)]; };
  if (first > last) return;
  std::size_t count = 0;
  const auto push = [&](const Vec2& p, std::size_t base) {
    const auto turn = [&] {
      const Vec2 &a = chain_[count - 2], &b = chain_[count - 1];
      return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
    };
    while (count >= base + 2 && turn() <= 0.0) --count;
    chain_[count++] = p;
  };
  smooth(profile, first, last, smooth_);
  // A column's ends are those at its middle; only the sides reach farther. Full-resolution row r covers half-resolution
  // (r - 1) / 2 to r / 2.
  const auto middle = [](std::int32_t g) { return 0.5 * kColumn_px * g + 0.25 * kColumn_px - 0.5; };
  const auto upper = [&](std::int32_t g) { return 0.5 * (smooth_[static_cast<std::size_t>(g)].top - 1); };
  const auto lower = [&](std::int32_t g) { return 0.5 * smooth_[static_cast<std::size_t>(g)].bottom; };
  const auto inside = [&](std::int32_t g, double row) {
    return !ends(g).empty() && middle(g) > sides.left.at(row) && middle(g) < sides.right.at(row);
  };
  struct Chain {  // columns between the sides, in one of the two directions
    std::int32_t first = -1, last = -1;
  };
  const auto between = [&](const auto& row_of) {
    Chain chain{first, last};
    while (chain.first <= last && !inside(chain.first, row_of(chain.first))) ++chain.first;
    while (chain.last >= first && !inside(chain.last, row_of(chain.last))) --chain.last;
    return chain;
  };
  const Chain top = between(upper), bottom = between(lower);
  if (top.first > top.last || bottom.first > bottom.last) return;
  // A side ends where it was last seen, or at the corner with the columns next to it if that is near.
  constexpr double kCorner_px = 4.0;
  const auto corner = [](const OutlineSide& side, double seen, double column_end) {
    const double row = !side.fitted || std::abs(seen - column_end) < kCorner_px ? column_end : seen;
    return Vec2{side.at(row), row};
  };
  const Vec2 top_left = corner(sides.left, sides.left.top_px, upper(top.first));
  const Vec2 top_right = corner(sides.right, sides.right.top_px, upper(top.last));
  const Vec2 bottom_left = corner(sides.left, sides.left.bottom_px, lower(bottom.first));
  const Vec2 bottom_right = corner(sides.right, sides.right.bottom_px, lower(bottom.last));
  push(top_left, 0);
  for (std::int32_t g = top.first; g <= top.last; ++g) {
    if (!inside(g, upper(g)) || middle(g) <= top_left.x() || middle(g) >= top_right.x()) continue;
    push({middle(g), upper(g)}, 0);
  }
  push(top_right, 0);
  const std::size_t base = count - 1;
  push(bottom_right, base);
  for (std::int32_t g = bottom.last; g >= bottom.first; --g) {
    if (!inside(g, lower(g)) || middle(g) <= bottom_left.x() || middle(g) >= bottom_right.x()) continue;
    push({middle(g), lower(g)}, base);
  }
  push(bottom_left, base);
  // Too many corners for an outline: every second one goes first, which only shrinks it.
  while (count > kMaxOutline) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; i += 2) chain_[kept++] = chain_[i];
    count = kept;
  }
  for (std::size_t i = 0; i < count; ++i) static_cast<void>(outline.try_push_back(chain_[i]));
  reduce(outline, max_vertices, 0.0);
}

}  // namespace polygmap
