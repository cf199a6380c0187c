// SPDX-License-Identifier: Apache-2.0
// Rows that are in no span, given to planes seen beside them or found in the remainder.
#include <algorithm>
#include <bit>

#include "algorithms/perception/image/simd.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {

// As offset() has it, and as uncertain as the plane is there.
SpanBoundaries::Rows SpanBoundaries::fitting(const Line& line, std::int32_t column, std::int32_t first) const noexcept {
  using Wide = cv::v_float32;
  static_assert(kRowsAtOnce % Wide::nlanes == 0 && kDepthHeight_px % kRowsAtOnce == 0);
  const auto all = [](float x) { return cv::vx_setall_f32(x); };
  Rows rows;
  for (std::int32_t i = 0; i < kRowsAtOnce; i += Wide::nlanes) {
    const Wide w = cv::vx_load(image_->down.row(column) + first + i), y = cv::vx_load(rays_->y.data() + first + i);
    const Wide residual = (w - (all(line.a) + all(line.b) * y)) * w;
    const Wide sigma = ((all(base_) * w + all(per_metre_)) * w + all(quadratic_)) * all(line.norm);
    const Wide pixels =
        cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand_q(image_->valid_down.row(column) + first + i)));
    const Wide most =
        all(kTruncation) *
        (sigma * sigma * (all(correlated_share_) * pixels + all(1.0F - correlated_share_)) + all(line.own) * pixels);
    const Wide measured = w > all(0.0F), fits = measured & (residual * residual * pixels < most);
    rows.measured |= static_cast<std::uint32_t>(cv::v_signmask(measured)) << i;
    rows.fit |= static_cast<std::uint32_t>(cv::v_signmask(fits)) << i;
  }
  return rows;
}

void SpanBoundaries::weigh_candidate(std::int32_t column, const Line& line, const ColumnSpan& candidate,
                                     std::int32_t& most, ColumnSpan& filled) const noexcept {
  // A bit for each row that fits, from the first of the candidate's on.
  constexpr std::int32_t kBits = 64;
  std::array<std::uint64_t, kDepthHeight_px / kBits + 2> fits{};
  const std::int32_t count = candidate.bottom - candidate.top + 1;
  std::int32_t fit = 0;
  for (std::int32_t at = 0; at < count; at += kRowsAtOnce) {
    // The last rows of the picture are looked at with others before them.
    const std::int32_t first = std::min(candidate.top + at, kDepthHeight_px - kRowsAtOnce);
    const std::uint32_t rows = fitting(line, column, first).fit >> (candidate.top + at - first);
    const std::uint64_t bits = rows & ((1U << std::min(count - at, kRowsAtOnce)) - 1U);
    fits[static_cast<std::size_t>(at / kBits)] |= bits << (at % kBits);
    fit += std::popcount(bits);
  }
  if (fit <= most) return;
  const auto bits_from = [&fits](std::int32_t at) {
    const std::uint64_t* word = &fits[static_cast<std::size_t>(at / kBits)];
    return word[0] >> (at % kBits) | word[1] << 1 << (kBits - 1 - at % kBits);
  };
  // The longest stretch of rows that fit; a single row off the plane or without data does not end it.
  for (std::int32_t at = 0; count - at > most;) {
    const std::uint64_t bits = bits_from(at);
    if (bits == 0) {
      at += kBits;
      continue;
    }
    const std::int32_t top = at + std::countr_zero(bits);
    std::int32_t rows = 0;
    std::uint64_t ends = 0;  // a bit for each row off the plane with another after it
    for (at = top; ends == 0;) {
      const std::uint64_t here = bits_from(at);
      ends = ~here & ~here >> 1;
      const std::int32_t until = std::min(std::countr_zero(ends), kBits - 2);  // the last two may begin such a pair
      rows += std::popcount(here & ((std::uint64_t{1} << until) - 1U));
      at += until;
    }
    if (rows <= most) continue;
    most = rows;
    filled.top = static_cast<std::int16_t>(candidate.top + top);
    filled.bottom = static_cast<std::int16_t>(candidate.top + at - 1);
    filled.plane = candidate.plane;
  }
}

SpanBoundaries::Depths SpanBoundaries::depths_of(std::int32_t column, std::int32_t first,
                                                 std::int32_t last) const noexcept {
  using Wide = cv::v_float32;
  constexpr float kNone = 1e9F;  // 1/m
  static constexpr std::array<float, kRowsAtOnce> kSteps{0, 1, 2, 3, 4, 5, 6, 7};
  const float* w = image_->down.row(column);
  const Wide zero = cv::vx_setall_f32(0.0F), none = cv::vx_setall_f32(kNone);
  Wide least = none, most = zero;
  // Whole registers; the last one begins earlier, and what it has besides does not count if it is the only one.
  for (std::int32_t r = first;; r += Wide::nlanes) {
    const std::int32_t start = std::max(std::min(r, last + 1 - Wide::nlanes), 0);
    const Wide row = cv::vx_load(kSteps.data()) + cv::vx_setall_f32(static_cast<float>(start));
    const Wide some = cv::vx_load(w + start) & (row >= cv::vx_setall_f32(static_cast<float>(first))) &
                      (row <= cv::vx_setall_f32(static_cast<float>(last)));
    least = cv::v_min(least, cv::v_select(some > zero, some, none));
    most = cv::v_max(most, some);
    if (r + Wide::nlanes > last) break;
  }
  return {cv::v_reduce_min(least), cv::v_reduce_max(most)};
}

// Whether any row with a depth in that range could lie on the line.
bool SpanBoundaries::reaches(const Line& line, std::int32_t top, std::int32_t bottom,
                             const Depths& depths) const noexcept {
  const float at_top = line.a + line.b * rays_->y[static_cast<std::size_t>(top)];
  const float at_bottom = line.a + line.b * rays_->y[static_cast<std::size_t>(bottom)];
  // Without what the plane's own place is uncertain by: some row comes nearer than that.
  const float most =
      math::sqrt(kTruncation) * line.norm * (base_ * depths.nearest + per_metre_ + quadratic_ / depths.farthest);
  return std::max(at_top, at_bottom) + most >= depths.farthest && std::min(at_top, at_bottom) - most <= depths.nearest;
}

float SpanBoundaries::own_variance(std::uint8_t plane, std::int32_t column, std::int32_t row) const noexcept {
  const Vec3 ray{static_cast<double>(rays_->x[static_cast<std::size_t>(column)]),
                 static_cast<double>(rays_->y[static_cast<std::size_t>(row)]), 1.0};
  const Plane& p = planes_[plane];
  return static_cast<float>(ray.dot(p.covariance * ray) * math::square(p.plane.inverse_depth(ray)));
}

void SpanBoundaries::consider(const Gap& gap, std::uint8_t plane, std::int32_t top, std::int32_t bottom,
                              const Depths& depths, std::int32_t& most, ColumnSpan& filled) const noexcept {
  if (!gap.may_be(plane) || bottom - top < most || !depths.any()) return;
  Line line = line_of(plane, gap.column);
  if (!reaches(line, top, bottom, depths)) return;
  line.own = own_variance(plane, gap.column, (top + bottom) / 2);
  ColumnSpan candidate;
  candidate.plane = plane;
  candidate.top = static_cast<std::int16_t>(top);
  candidate.bottom = static_cast<std::int16_t>(bottom);
  weigh_candidate(gap.column, line, candidate, most, filled);
}

void SpanBoundaries::consider(const Gap& gap, std::size_t first_plane, std::size_t last_plane, std::int32_t& most,
                              ColumnSpan& filled) const noexcept {
  const bool deep = gap.until - gap.from >= 2 * kRemainderReach_px;
  const std::int32_t upper_end = deep ? gap.from + kRemainderReach_px - 1 : gap.until;
  const std::int32_t lower_start = gap.until - kRemainderReach_px + 1;
  const Depths upper = depths_of(gap.column, gap.from, upper_end);
  const Depths lower = deep ? depths_of(gap.column, lower_start, gap.until) : upper;
  for (std::size_t p = first_plane; p <= last_plane; ++p) {
    const auto plane = static_cast<std::uint8_t>(p);
    consider(gap, plane, gap.from, upper_end, upper, most, filled);
    if (deep) consider(gap, plane, lower_start, gap.until, lower, most, filled);
  }
}

void SpanBoundaries::fill_gaps(std::int32_t column, std::int32_t beside, std::size_t first_plane,
                               std::size_t last_plane) noexcept {
  constexpr std::int32_t kReach_px = 4;  // beyond the rows of the span beside
  constexpr std::int32_t kMinRows = 2;   // that fit
  Column& spans = columns_[static_cast<std::size_t>(column)];
  const bool any_beside = beside >= 0 && beside < rays_->columns;
  std::int32_t from = 0;
  std::size_t next_beside = 0;  // the first span there that reaches down to this gap
  for (std::size_t k = 0; k <= spans.size(); ++k) {
    const std::int32_t until = k < spans.size() ? spans[k].top - 1 : rays_->height_px - 1;
    const std::int32_t gap_from = from;
    if (k < spans.size()) from = spans[k].bottom + 1;
    if (until <= gap_from) continue;
    if (spans.full()) {
      ++overflow_;
      return;
    }
    const Gap gap{column, gap_from, until, k > 0 ? spans[k - 1].plane : std::uint8_t{0},
                  k < spans.size() ? spans[k].plane : std::uint8_t{0}};
    std::int32_t most = kMinRows - 1;
    ColumnSpan filled;
    if (any_beside) {
      const Column& others = columns_[static_cast<std::size_t>(beside)];
      while (next_beside < others.size() && others[next_beside].bottom + kReach_px < gap_from) ++next_beside;
      for (std::size_t i = next_beside; i < others.size() && others[i].top - kReach_px <= until; ++i) {
        const ColumnSpan& other = others[i];
        const std::int32_t top = std::max(gap_from, other.top - kReach_px);
        const std::int32_t bottom = std::min(until, other.bottom + kReach_px);
        if (!gap.may_be(other.plane) || bottom - top < most) continue;
        consider(gap, other.plane, top, bottom, depths_of(column, top, bottom), most, filled);
      }
    }
    if (first_plane <= last_plane) consider(gap, first_plane, last_plane, most, filled);
    if (most < kMinRows || !spans.try_push_back(filled)) continue;
    std::rotate(spans.begin() + static_cast<std::ptrdiff_t>(k), spans.end() - 1, spans.end());
    from = filled.bottom + 1;
  }
}

}  // namespace polygmap
