// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/ground_route.hpp"

#include <algorithm>
#include <bit>

namespace polygmap {
namespace {

using Rows = GroundView::Rows;
constexpr std::int32_t kSide = GroundView::kSide_cells;

[[nodiscard]] std::uint64_t bit(std::int32_t x) noexcept { return std::uint64_t{1} << static_cast<std::uint32_t>(x); }
[[nodiscard]] std::uint64_t beside(std::uint64_t row) noexcept { return row << 1U | row >> 1U; }
[[nodiscard]] std::uint64_t& row_of(Rows& rows, std::int32_t y) noexcept { return rows[static_cast<std::size_t>(y)]; }

// By so many squares, in eight directions as nearly as squares can.
void grow(Rows& rows, std::int32_t squares) noexcept {
  for (std::int32_t i = 0; i < squares; ++i) {
    const bool diagonal = i % 2 != 0;
    std::uint64_t above = 0;
    for (std::size_t y = 0; y < rows.size(); ++y) {
      const std::uint64_t here = rows[y], below = y + 1 < rows.size() ? rows[y + 1] : 0;
      const std::uint64_t lines = above | below;
      rows[y] |= beside(here) | lines | (diagonal ? beside(lines) : 0);
      above = here;
    }
  }
}

// Leaves what is within the radius of the middle.
void keep_within(Rows& rows, std::int32_t x, std::int32_t y, std::int32_t radius) noexcept {
  for (std::int32_t row = 0; row < kSide; ++row) {
    const std::int32_t rest = radius * radius - (row - y) * (row - y);
    std::uint64_t kept = 0;
    if (rest >= 0) {
      const auto half = static_cast<std::int32_t>(math::sqrt(static_cast<double>(rest)));
      const std::int32_t first = std::clamp(x - half, 0, kSide - 1), last = std::clamp(x + half, 0, kSide - 1);
      kept = (~std::uint64_t{0} << static_cast<std::uint32_t>(first)) &
             (~std::uint64_t{0} >> static_cast<std::uint32_t>(kSide - 1 - last));
    }
    row_of(rows, row) &= kept;
  }
}

[[nodiscard]] std::int32_t squares_of(double m) noexcept { return static_cast<std::int32_t>(m / GroundView::kCell_m); }

}  // namespace

GroundRoute::Cell GroundRoute::cell_at(const Vec2& odom_p_m) const noexcept {
  const auto of = [](double along_m) {
    return static_cast<std::int32_t>(std::floor(math::clamp(along_m / GroundView::kCell_m, -1e6, 1e6)));
  };
  return {of(odom_p_m.x() - corner_m_.x()), of(odom_p_m.y() - corner_m_.y())};
}

Vec2 GroundRoute::middle_m(const Cell& cell) const noexcept {
  return corner_m_ + Vec2{cell.x + 0.5, cell.y + 0.5} * GroundView::kCell_m;
}

// Outside the view nothing is in the way.
bool GroundRoute::is_clear(const Vec2& a_m, const Vec2& b_m) const noexcept {
  const Vec2 way_m = b_m - a_m;
  constexpr double kFarthest_m = GroundView::kSide_cells * GroundView::kCell_m, kStep_m = 0.5 * GroundView::kCell_m;
  const double length_m = std::min(way_m.norm(), kFarthest_m);
  if (length_m < kStep_m) return true;
  const Vec2 step_m = kStep_m / way_m.norm() * way_m;
  const auto steps = static_cast<std::int32_t>(length_m / kStep_m);
  for (std::int32_t i = 1; i <= steps; ++i) {
    const Cell cell = cell_at(a_m + i * step_m);
    if (GroundView::has(shut_, cell.x, cell.y)) return false;
  }
  return true;
}

void GroundRoute::begin(const GroundRouteParams& params, const GroundView& ground, const Barred& barred,
                        const Vec2& from_m, const Vec2& to_m) noexcept {
  corner_m_ = ground.corner_m;
  from_m_ = from_m;
  is_busy_ = false;
  start_ = cell_at(from_m);
  if (start_.x < 0 || start_.y < 0 || start_.x >= kSide || start_.y >= kSide) {
    way_ = Way::kUnknown;
    return;
  }
  for (std::size_t y = 0; y < dear_.size(); ++y) dear_[y] = ~ground.level[y] | barred.walked[y];
  Rows tall = ground.tall;
  keep_within(tall, start_.x, start_.y, squares_of(params.ahead_m));
  shut_ = tall;
  grow(shut_, squares_of(params.thing_m) - squares_of(params.brink_m));
  for (std::size_t y = 0; y < shut_.size(); ++y) shut_[y] |= barred.unseen[y] & ~ground.level[y];
  grow(shut_, squares_of(params.brink_m));
  for (std::size_t y = 0; y < shut_.size(); ++y) shut_[y] |= barred.tried[y];
  // Where it stands nearer to something than it is to go, the way leads away from there.
  Rows own{};
  row_of(own, start_.y) = bit(start_.x);
  grow(own, squares_of(params.brink_m));
  for (std::size_t y = 0; y < shut_.size(); ++y) {
    dear_[y] |= shut_[y];
    shut_[y] &= ~own[y] | tall[y];
  }
  if (is_clear(from_m, to_m)) {
    way_ = Way::kStraight;
    return;
  }
  const bool holds = way_ == Way::kRound && (via_m_ - from_m).norm() > params.reached_m && is_clear(from_m, via_m_);
  if (holds) return;
  sow(to_m);
  is_busy_ = true;
}

// The wave begins at the goal; where that lies beyond the view, it comes in over the view's edges.
void GroundRoute::sow(const Vec2& to_m) noexcept {
  reached_ = front_ = late_ = {};
  now_ = 0;
  inside_ = false;
  time_.fill(kNever);
  edge_time_.fill(kNever);
  const Cell to = cell_at(to_m);
  if (to.x >= 0 && to.y >= 0 && to.x < kSide && to.y < kSide) {
    row_of(front_, to.y) = bit(to.x);
    inside_ = GroundView::has(shut_, to.x, to.y);
    return;
  }
  double nearest = 1e9;
  const auto each = [&](auto&& visit) {
    for (std::int32_t i = 0; i < kSide; ++i) {
      visit(i, Cell{i, 0});
      visit(kSide + i, Cell{i, kSide - 1});
      visit(2 * kSide + i, Cell{0, i});
      visit(3 * kSide + i, Cell{kSide - 1, i});
    }
  };
  const auto away = [&](const Cell& cell) { return (to_m - middle_m(cell)).norm() / GroundView::kCell_m; };
  each([&](std::int32_t, const Cell& cell) { nearest = std::min(nearest, away(cell)); });
  each([&](std::int32_t i, const Cell& cell) {
    const double later = away(cell) - nearest;
    if (later < kNever - 1) edge_time_[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(later);
  });
}

void GroundRoute::wave() noexcept {
  for (std::int32_t i = 0; i < kSide; ++i) {
    const auto comes_in = [&](std::int32_t edge) {
      return edge_time_[static_cast<std::size_t>(edge * kSide + i)] == now_;
    };
    if (comes_in(0)) row_of(front_, 0) |= bit(i);
    if (comes_in(1)) row_of(front_, kSide - 1) |= bit(i);
    if (comes_in(2)) row_of(front_, i) |= bit(0);
    if (comes_in(3)) row_of(front_, i) |= bit(kSide - 1);
  }
  const bool diagonal = now_ % 2 != 0;
  Rows next{};
  bool outside = false;
  for (std::int32_t y = 0; y < kSide; ++y) {
    std::uint64_t fresh = row_of(front_, y) & ~row_of(reached_, y);
    row_of(front_, y) = fresh;
    row_of(reached_, y) |= fresh;
    outside = outside || (fresh & ~row_of(shut_, y)) != 0;
    for (; fresh != 0; fresh &= fresh - 1) time(std::countr_zero(fresh), y) = now_;
  }
  inside_ = inside_ && !outside;
  for (std::int32_t y = 0; y < kSide; ++y) {
    const std::uint64_t shut = inside_ ? 0 : row_of(shut_, y);
    const std::uint64_t lines = (y > 0 ? row_of(front_, y - 1) : 0) | (y + 1 < kSide ? row_of(front_, y + 1) : 0);
    const std::uint64_t about =
        (beside(row_of(front_, y)) | lines | (diagonal ? beside(lines) : 0)) & ~row_of(reached_, y) & ~shut;
    row_of(next, y) = (about & ~row_of(dear_, y)) | row_of(late_, y);
    row_of(late_, y) = about & row_of(dear_, y);
  }
  front_ = next;
  ++now_;
}

void GroundRoute::step(const GroundRouteParams& params) noexcept {
  if (!is_busy_) return;
  for (std::int32_t i = 0; i < params.waves_per_tick; ++i) {
    wave();
    if (GroundView::has(reached_, start_.x, start_.y)) {
      follow();
      is_busy_ = false;
      way_ = Way::kRound;
      return;
    }
    if (now_ == kNever) {
      is_busy_ = false;
      way_ = Way::kShut;
      return;
    }
  }
}

// From square to square, each time to where the wave was first.
void GroundRoute::follow() noexcept {
  Cell at = start_;
  via_m_ = from_m_;
  for (std::int32_t i = 0; i < kNever; ++i) {
    Cell best = at;
    std::uint8_t first = time(at.x, at.y);
    for (std::int32_t y = std::max(at.y - 1, 0); y <= std::min(at.y + 1, kSide - 1); ++y) {
      for (std::int32_t x = std::max(at.x - 1, 0); x <= std::min(at.x + 1, kSide - 1); ++x) {
        if (time(x, y) >= first) continue;
        first = time(x, y);
        best = {x, y};
      }
    }
    if (best.x == at.x && best.y == at.y) return;
    at = best;
    if (!is_clear(from_m_, middle_m(at))) return;
    via_m_ = middle_m(at);
  }
}

}  // namespace polygmap
