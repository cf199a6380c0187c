// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/column_outline.hpp"

#include <algorithm>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

using Rows = cv::v_int16x8;
constexpr std::int32_t kAtOnce = Rows::nlanes / 2;  // columns of two ends each
static_assert(sizeof(ColumnExtent) == 2 * sizeof(std::int16_t));

Rows median(const Rows& a, const Rows& b, const Rows& c, const Rows& d, const Rows& e) noexcept {
  // Neither the least nor the largest of four is the median of five; of the other two and the fifth it is the middle.
  const Rows f = cv::v_max(cv::v_min(a, b), cv::v_min(c, d));
  const Rows g = cv::v_min(cv::v_max(a, b), cv::v_max(c, d));
  return cv::v_max(cv::v_min(f, g), cv::v_min(cv::v_max(f, g), e));
}

// A hull follows its outermost points, and with them the noise: the median of five columns, where there are five.
void smooth(const ColumnExtents& profile, std::int32_t first, std::int32_t last,
            std::array<ColumnExtent, kColumns>& smoothed) noexcept {
  const ColumnExtent* ends = profile.columns.data();
  std::copy(ends + first, ends + last + 1, smoothed.begin() + first);
  for (std::int32_t g = first + 2; g <= last - 2; g += kAtOnce) {
    // The picture's last ones are looked at with others before them, which become the same again.
    const std::int32_t from = std::min(g, kColumns - 2 - kAtOnce);
    const auto beside = [&](std::int32_t columns) { return cv::v_load(&ends[from + columns].top); };
    const Rows a = beside(-2), b = beside(-1), c = beside(0), d = beside(1), e = beside(2);
    // A column without the surface has -1 twice.
    const Rows all = cv::v_min(cv::v_min(cv::v_min(a, b), cv::v_min(c, d)), e) >= cv::v_setzero_s16();
    cv::v_store(&smoothed[static_cast<std::size_t>(from)].top, cv::v_select(all, median(a, b, c, d, e), c));
  }
  std::copy(ends + std::max(last - 1, first), ends + last + 1, smoothed.begin() + std::max(last - 1, first));
}

}  // namespace

// Keeps the corners from base on a chain that turns one way only.
void ColumnOutline::push(const Vec2& p, std::size_t base) noexcept {
  const auto turn = [&] {
    const Vec2 &a = chain_[count_ - 2], &b = chain_[count_ - 1];
    return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
  };
  while (count_ >= base + 2 && turn() <= 0.0) --count_;
  chain_[count_++] = p;
}

// Too many corners for an outline: every second one goes first, which only shrinks it.
void ColumnOutline::thin() noexcept {
  while (count_ > kMaxOutline) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; i += 2) chain_[kept++] = chain_[i];
    count_ = kept;
  }
}

void ColumnOutline::build(const ColumnExtents& profile, const OutlineSides& sides, double corner_px,
                          std::size_t max_vertices, Outline2& outline) noexcept {
  outline.clear();
  const std::int32_t first = profile.first_column, last = profile.last_column;
  const auto ends = [&profile](std::int32_t g) { return profile.columns[static_cast<std::size_t>(g)]; };
  work_.add(60);
  if (first > last) return;
  work_.add(350 + 138 * (last - first + 1));
  count_ = 0;
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
  const auto corner = [corner_px](const OutlineSide& side, double seen, double column_end) {
    const double row = !side.fitted || std::abs(seen - column_end) < corner_px ? column_end : seen;
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
  const std::size_t base = count_ - 1;
  push(bottom_right, base);
  for (std::int32_t g = bottom.last; g >= bottom.first; --g) {
    if (!inside(g, lower(g)) || middle(g) <= bottom_left.x() || middle(g) >= bottom_right.x()) continue;
    push({middle(g), lower(g)}, base);
  }
  push(bottom_left, base);
  thin();
  for (std::size_t i = 0; i < count_; ++i) static_cast<void>(outline.try_push_back(chain_[i]));
  const auto corners = static_cast<std::int32_t>(outline.size());
  reduce(outline, max_vertices, 0.0);
  work_.add((corners - static_cast<std::int32_t>(outline.size()) + 1) * corners * 24);
}

}  // namespace polygmap
