// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/column_outline.hpp"

#include <algorithm>

namespace polygmap {
namespace {

// A hull follows its outermost points, and with them the noise: the median of five columns first.
ColumnEnds smoothed(const SurfaceProfile& profile, std::int32_t g) noexcept {
  constexpr std::int32_t kReach = 2;
  std::array<std::int16_t, 2 * kReach + 1> tops{}, bottoms{};
  std::ptrdiff_t n = 0;
  for (std::int32_t i = std::max(g - kReach, 0); i <= std::min(g + kReach, kColumns - 1); ++i) {
    const ColumnEnds& ends = profile.columns[static_cast<std::size_t>(i)];
    if (ends.empty()) continue;
    tops[static_cast<std::size_t>(n)] = ends.top;
    bottoms[static_cast<std::size_t>(n++)] = ends.bottom;
  }
  if (n < 2 * kReach + 1) return profile.columns[static_cast<std::size_t>(g)];
  std::nth_element(tops.begin(), tops.begin() + kReach, tops.end());
  std::nth_element(bottoms.begin(), bottoms.begin() + kReach, bottoms.end());
  return {tops[kReach], bottoms[kReach]};
}

}  // namespace

void ColumnOutline::build(const SurfaceProfile& profile, std::size_t max_vertices, Outline2& outline) noexcept {
  outline.clear();
  std::int32_t first = 0, last = kColumns - 1;
  const auto ends = [&profile](std::int32_t g) { return profile.columns[static_cast<std::size_t>(g)]; };
  while (first <= last && ends(first).empty()) ++first;
  while (last >= first && ends(last).empty()) --last;
  if (first > last) return;
  std::size_t count = 0;
  const auto push = [&](double x, double y, std::size_t base) {
    const Vec2 p{x, y};
    const auto turn = [&] {
      const Vec2 &a = chain_[count - 2], &b = chain_[count - 1];
      return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
    };
    while (count >= base + 2 && turn() <= 0.0) --count;
    chain_[count++] = p;
  };
  // A column's ends are those at its middle; only the outermost ones reach to the sides. Full-resolution row r covers
  // half-resolution (r - 1) / 2 to r / 2.
  const auto middle = [](std::int32_t g) { return 2.0 * g + 0.5; };
  const auto upper = [&](std::int32_t g) { return 0.5 * (smoothed(profile, g).top - 1); };
  const auto lower = [&](std::int32_t g) { return 0.5 * smoothed(profile, g).bottom; };
  const double left = profile.left - 0.5, right = profile.right + 0.5;
  push(left, upper(first), 0);
  for (std::int32_t g = first; g <= last; ++g) {
    if (!ends(g).empty() && middle(g) > left && middle(g) < right) push(middle(g), upper(g), 0);
  }
  push(right, upper(last), 0);
  const std::size_t base = count - 1;
  push(right, lower(last), base);
  for (std::int32_t g = last; g >= first; --g) {
    if (!ends(g).empty() && middle(g) > left && middle(g) < right) push(middle(g), lower(g), base);
  }
  push(left, lower(first), base);
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
