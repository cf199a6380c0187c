// SPDX-License-Identifier: Apache-2.0
// Rows that are in no span, given to planes seen beside them or found in the remainder.
#include <algorithm>
#include <bit>

#include "algorithms/perception/image/simd.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {
namespace {

using simd::all, simd::Wide;

}  // namespace

// As offset() has it, and as uncertain as the plane is there.
SpanBoundaries::Rows SpanBoundaries::fitting(const Line& line, std::int32_t column, std::int32_t first) const noexcept {
  static_assert(kRowsAtOnce % Wide::nlanes == 0 && kDepthHeight_px % kRowsAtOnce == 0);
  const InverseSigma<Wide> sigma_of = all(inverse_sigma_);
  const MeanShare<Wide> share = all(mean_share_);
  Rows rows;
  for (std::int32_t i = 0; i < kRowsAtOnce; i += Wide::nlanes) {
    const Wide w = cv::vx_load(image_->by_column.row(column) + first + i);
    const Wide y = cv::vx_load(rays_->y.data() + first + i);
    const Wide residual = (w - (all(line.a) + all(line.b) * y)) * w, sigma = sigma_of(w) * all(line.norm);
    const Wide pixels = simd::load_u8(image_->valid_by_column.row(column) + first + i);
    const Wide most = all(kTruncation) * (sigma * sigma * share.times(pixels) + all(line.own) * pixels);
    const Wide measured = w > all(0.0F), fits = measured & (residual * residual * pixels < most);
    rows.measured |= simd::bits(measured) << i;
    rows.fit |= simd::bits(fits) << i;
  }
  return rows;
}

void SpanBoundaries::weigh_candidate(std::int32_t column, const Line& line, const ColumnSpan& candidate,
                                     std::int32_t& most, ColumnSpan& filled) noexcept {
  // A bit for each row that fits, from the first of the candidate's on.
  constexpr std::int32_t kBits = 64;  // of a word
  std::array<std::uint64_t, kDepthHeight_px / kBits + 2> fits{};
  const std::int32_t count = candidate.bottom - candidate.top + 1;
  std::int32_t fit = 0;
  work_.add(90 + 105 * ((count + kRowsAtOnce - 1) / kRowsAtOnce));
  for (std::int32_t at = 0; at < count; at += kRowsAtOnce) {
    // The last rows of the image are looked at with others before them.
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
    work_.add(45);
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
  constexpr float kNone = 1e9F;  // 1/m, more than any
  const float* w = image_->by_column.row(column);
  const Wide zero = all(0.0F), none = all(kNone);
  Wide least = none, most = zero;
  // Whole registers; the last one begins earlier, and what it has besides does not count if it is the only one.
  for (std::int32_t r = first;; r += Wide::nlanes) {
    const std::int32_t start = std::max(std::min(r, last + 1 - Wide::nlanes), 0);
    const Wide row = simd::steps_from(0) + all(start);
    const Wide some = cv::vx_load(w + start) & (row >= all(first)) & (row <= all(last));
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
      math::sqrt(kTruncation) * line.norm * inverse_sigma_.most_relative(depths.farthest, depths.nearest);
  return std::max(at_top, at_bottom) + most >= depths.farthest && std::min(at_top, at_bottom) - most <= depths.nearest;
}

float SpanBoundaries::own_variance(std::uint8_t plane, std::int32_t column, std::int32_t row) const noexcept {
  const Vec3 ray{static_cast<double>(rays_->x[static_cast<std::size_t>(column)]),
                 static_cast<double>(rays_->y[static_cast<std::size_t>(row)]), 1.0};
  const Plane& p = planes_[plane];
  return static_cast<float>(ray.dot(p.covariance * ray) * math::square(p.plane.inverse_depth(ray)));
}

void SpanBoundaries::consider(const Gap& gap, std::uint8_t plane, std::int32_t top, std::int32_t bottom,
                              const Depths& depths, std::int32_t& most, ColumnSpan& filled) noexcept {
  work_.add(16);
  if (!gap.may_be(plane) || bottom - top < most || !depths.any()) return;
  work_.add(45);
  Line line = line_of(plane, gap.column);
  if (!reaches(line, top, bottom, depths)) return;
  work_.add(60);
  line.own = own_variance(plane, gap.column, (top + bottom) / 2);
  ColumnSpan candidate;
  candidate.plane = plane;
  candidate.top = static_cast<std::int16_t>(top);
  candidate.bottom = static_cast<std::int16_t>(bottom);
  weigh_candidate(gap.column, line, candidate, most, filled);
}

void SpanBoundaries::consider(const Gap& gap, std::size_t first_plane, std::size_t last_plane, std::int32_t& most,
                              ColumnSpan& filled) noexcept {
  const bool deep = gap.until - gap.from >= 2 * kRemainderReach_px;
  const std::int32_t upper_end = deep ? gap.from + kRemainderReach_px - 1 : gap.until;
  const std::int32_t lower_start = gap.until - kRemainderReach_px + 1;
  work_.add(150 + 3 * (upper_end - gap.from));
  if (deep) work_.add(60 + 3 * kRemainderReach_px);
  const Depths upper = depths_of(gap.column, gap.from, upper_end);
  const Depths lower = deep ? depths_of(gap.column, lower_start, gap.until) : upper;
  for (std::size_t p = first_plane; p <= last_plane; ++p) {
    const auto plane = static_cast<std::uint8_t>(p);
    consider(gap, plane, gap.from, upper_end, upper, most, filled);
    if (deep) consider(gap, plane, lower_start, gap.until, lower, most, filled);
  }
}

void SpanBoundaries::consider_beside(const Gap& gap, const Column& others, std::size_t& next, std::int32_t& most,
                                     ColumnSpan& filled) noexcept {
  const std::int32_t reach_px = params_.beside_px;
  while (next < others.size() && others[next].bottom + reach_px < gap.from) ++next;
  for (std::size_t i = next; i < others.size() && others[i].top - reach_px <= gap.until; ++i) {
    work_.add(38);
    const ColumnSpan& other = others[i];
    const std::int32_t top = std::max(gap.from, other.top - reach_px);
    const std::int32_t bottom = std::min(gap.until, other.bottom + reach_px);
    if (!gap.may_be(other.plane) || bottom - top < most) continue;
    work_.add(50 + 3 * (bottom - top));
    consider(gap, other.plane, top, bottom, depths_of(gap.column, top, bottom), most, filled);
  }
}

void SpanBoundaries::fill_gaps(std::int32_t column, std::int32_t beside, std::size_t first_plane,
                               std::size_t last_plane) noexcept {
  const std::int32_t min_rows = params_.min_filled_rows;
  work_.add(60);
  Column& spans = columns_[static_cast<std::size_t>(column)];
  const bool any_beside = beside >= 0 && beside < rays_->columns;
  const Column& others = columns_[static_cast<std::size_t>(any_beside ? beside : column)];
  std::int32_t from = 0;
  std::size_t next_beside = 0;  // the first span there that reaches down to this gap
  for (std::size_t k = 0; k <= spans.size(); ++k) {
    work_.add(62);
    const bool last = k == spans.size();
    const Gap gap{column, from, last ? rays_->height_px - 1 : spans[k].top - 1,
                  k > 0 ? spans[k - 1].plane : std::uint8_t{0}, last ? std::uint8_t{0} : spans[k].plane};
    if (!last) from = spans[k].bottom + 1;
    if (gap.until <= gap.from) continue;
    if (spans.full()) {
      ++overflow_;
      return;
    }
    std::int32_t most = min_rows - 1;
    ColumnSpan filled;
    if (any_beside) consider_beside(gap, others, next_beside, most, filled);
    if (first_plane <= last_plane) consider(gap, first_plane, last_plane, most, filled);
    if (most < min_rows || !spans.try_push_back(filled)) continue;
    work_.add(30 + 8 * static_cast<std::int32_t>(spans.size() - k));
    std::rotate(spans.begin() + static_cast<std::ptrdiff_t>(k), spans.end() - 1, spans.end());
    from = filled.bottom + 1;
  }
}

}  // namespace polygmap
