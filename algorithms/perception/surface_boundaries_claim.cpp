// SPDX-License-Identifier: Apache-2.0
// Rows that are in no span, given to planes seen beside them or found in the remainder.
#include <algorithm>

#include "algorithms/perception/surface_boundaries.hpp"

namespace polygmap {

void SurfaceBoundaries::weigh_claim(std::int32_t column, const ColumnSpan& candidate, std::int32_t& most,
                                    ColumnSpan& claimed) const noexcept {
  const Line line = line_of(planes_[candidate.plane].plane, column);
  // The longest stretch of rows that fit; a single row off the plane or without data does not end it.
  std::int32_t top = -1, bottom = -1, fitting = 0, off = 0;
  const auto close = [&] {
    if (fitting > most) {
      most = fitting;
      claimed.top = static_cast<std::int16_t>(top);
      claimed.bottom = static_cast<std::int16_t>(bottom);
      claimed.plane = candidate.plane;
    }
    fitting = off = 0;
    top = -1;
  };
  const auto fits = [&](std::int32_t r) {
    return image_->valid(column, r) != 0 && offset(line, column, r).within(kTruncation);
  };
  // Outside a stretch every second row is looked at: that meets all those with two rows in a row.
  for (std::int32_t r = candidate.top; r <= candidate.bottom; r += fitting > 0 ? 1 : 2) {
    if (fits(r)) {
      if (fitting == 0) top = r > candidate.top && fits(r - 1) ? r - 1 : r;
      fitting += fitting == 0 ? r - top + 1 : 1;
      bottom = r;
      off = 0;
    } else if (fitting > 0 && ++off > 1) {
      close();
    }
    if (fitting == 0 && candidate.bottom - r <= most) return;  // too few are left
  }
  close();
}

SurfaceBoundaries::Depths SurfaceBoundaries::depths_of(std::int32_t column, std::int32_t first,
                                                       std::int32_t last) const noexcept {
  constexpr float kNone = 1e9F;  // 1/m
  Depths depths{kNone, 0.0F};
  for (std::int32_t r = first; r <= last; ++r) {
    const float w = image_->inverse_depth(column, r);
    depths.farthest = std::min(depths.farthest, w > 0.0F ? w : kNone);
    depths.nearest = std::max(depths.nearest, w);
  }
  return depths;
}

// Whether any row with a depth in that range could lie on the plane.
bool SurfaceBoundaries::reaches(std::int32_t column, std::uint8_t plane, std::int32_t top, std::int32_t bottom,
                                const Depths& depths) const noexcept {
  if (depths.nearest < depths.farthest) return false;
  const Line line = line_of(planes_[plane].plane, column);
  const float at_top = line.a + line.b * rays_->y[static_cast<std::size_t>(top)];
  const float at_bottom = line.a + line.b * rays_->y[static_cast<std::size_t>(bottom)];
  // No row's tolerance is larger.
  const float most =
      math::sqrt(kTruncation) * line.norm * (base_ * depths.nearest + per_metre_ + quadratic_ / depths.farthest);
  return std::max(at_top, at_bottom) + most >= depths.farthest && std::min(at_top, at_bottom) - most <= depths.nearest;
}

void SurfaceBoundaries::claim(std::int32_t column, std::int32_t beside, std::size_t first_plane,
                              std::size_t last_plane) noexcept {
  constexpr std::int32_t kReach_px = 4;  // beyond the rows of the span beside
  constexpr std::int32_t kMinRows = 2;   // that fit
  Column& spans = columns_[static_cast<std::size_t>(column)];
  const bool any_beside = beside >= 0 && beside < rays_->columns;
  std::int32_t from = 0;
  for (std::size_t k = 0; k <= spans.size(); ++k) {
    const std::int32_t until = k < spans.size() ? spans[k].top - 1 : rays_->height_px - 1;
    const std::int32_t gap_from = from;
    if (k < spans.size()) from = spans[k].bottom + 1;
    if (until <= gap_from) continue;
    if (spans.full()) {
      ++overflow_;
      return;
    }
    const std::uint8_t above = k > 0 ? spans[k - 1].plane : std::uint8_t{0};
    const std::uint8_t below = k < spans.size() ? spans[k].plane : std::uint8_t{0};
    std::int32_t most = kMinRows - 1;
    ColumnSpan claimed;
    Depths depths;  // of the gap, when they are first asked for
    const auto consider = [&](std::uint8_t plane, std::int32_t top, std::int32_t bottom) {
      if (plane == above || plane == below || bottom - top < most) return;
      if (depths.farthest < 0.0F) depths = depths_of(column, gap_from, until);
      if (!reaches(column, plane, top, bottom, depths)) return;
      ColumnSpan candidate;
      candidate.plane = plane;
      candidate.top = static_cast<std::int16_t>(top);
      candidate.bottom = static_cast<std::int16_t>(bottom);
      weigh_claim(column, candidate, most, claimed);
    };
    if (any_beside) {
      for (const ColumnSpan& other : columns_[static_cast<std::size_t>(beside)]) {
        if (other.top - kReach_px > until) break;
        if (other.bottom + kReach_px < gap_from) continue;
        consider(other.plane, std::max(gap_from, other.top - kReach_px), std::min(until, other.bottom + kReach_px));
      }
    }
    const bool deep = until - gap_from >= 2 * kRemainderReach_px;
    for (std::size_t p = first_plane; p <= last_plane; ++p) {
      const auto plane = static_cast<std::uint8_t>(p);
      consider(plane, gap_from, deep ? gap_from + kRemainderReach_px - 1 : until);
      if (deep) consider(plane, until - kRemainderReach_px + 1, until);
    }
    if (most < kMinRows || !spans.try_push_back(claimed)) continue;
    std::rotate(spans.begin() + static_cast<std::ptrdiff_t>(k), spans.end() - 1, spans.end());
    from = claimed.bottom + 1;
  }
}

}  // namespace polygmap
