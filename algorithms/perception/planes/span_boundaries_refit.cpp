// SPDX-License-Identifier: Apache-2.0
// The planes' moments within their boundaries, and the noise that their rows show.
#include <algorithm>
#include <bit>

#include "algorithms/perception/image/simd.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {
namespace {

using simd::all, simd::Four, simd::Wide;
using Eight = cv::v_int16x8;
using Slots = std::array<float, SpanBoundaries::kRefitColumns>;

// The same order of summing for every register width.
float sum_of(const Slots& slots) noexcept {
  static_assert(SpanBoundaries::kRefitColumns == 2 * Four::nlanes);
  Four sum = cv::v_load(slots.data()) + cv::v_load(slots.data() + Four::nlanes);
  sum = sum + cv::v_rotate_left<1>(sum);
  sum = sum + cv::v_rotate_left<2>(sum);
  return cv::v_extract_n<3>(sum);
}

}  // namespace

void SpanBoundaries::begin_refit() noexcept {
  noise_samples_.clear();
  next_span_.fill(0);
  work_.add(1200 + 22 * static_cast<std::int32_t>(planes_.size()));
  for (Plane& plane : planes_) {
    plane.moments = PlaneMoments{};
    plane.residual2 = 0.0;
    plane.seen_px = 0.0;
  }
}

void SpanBoundaries::show_next(std::int32_t first_column, std::size_t slot, Front& front) const noexcept {
  const std::size_t column = static_cast<std::size_t>(first_column) + slot;
  const bool in_picture = static_cast<std::int32_t>(column) < rays_->columns;
  const std::size_t i = next_span_[slot];
  const bool any = in_picture && i < columns_[column].size();
  front.top[slot] = any ? columns_[column][i].top : Front::kNone;
  front.plane[slot] = any ? static_cast<std::int16_t>(columns_[column][i].plane) : Front::kNone;
}

// Down the columns together.
bool SpanBoundaries::take_strip(std::int32_t first_column, Front& front, Strip& strip) noexcept {
  static_assert(kRefitColumns == Eight::nlanes);
  const Eight tops = cv::v_load(front.top.data());
  const std::int16_t topmost = cv::v_reduce_min(tops);
  if (topmost == Front::kNone) return false;
  const auto first = static_cast<std::size_t>(std::countr_zero(simd::bits(tops == cv::v_setall_s16(topmost))));
  const std::int16_t plane = front.plane[first];
  strip.plane = static_cast<PlaneId>(plane);
  cv::v_store(strip.top.data(), cv::v_setall_s16(1));
  cv::v_store(strip.bottom.data(), cv::v_setzero_s16());
  for (std::uint32_t left = simd::bits(cv::v_load(front.plane.data()) == cv::v_setall_s16(plane)); left != 0;
       left &= left - 1) {
    const auto slot = static_cast<std::size_t>(std::countr_zero(left));
    const ColumnSpan& span = columns_[static_cast<std::size_t>(first_column) + slot][next_span_[slot]++];
    const int margin = span.bottom - span.top >= params_.thick_px ? 1 : 0;
    strip.top[slot] = static_cast<std::int16_t>(span.top + margin);
    strip.bottom[slot] = static_cast<std::int16_t>(span.bottom - margin);
    show_next(first_column, slot, front);
  }
  return true;
}

bool SpanBoundaries::refit_some(std::int32_t first_column, bool roughly) noexcept {
  constexpr std::int32_t kPieceInstructions = 8000;
  const std::int32_t enough = work_.instructions() + kPieceInstructions;
  Front front;
  work_.add(kRefitColumns, 12);
  for (std::size_t slot = 0; slot < kRefitColumns; ++slot) show_next(first_column, slot, front);
  while (work_.instructions() < enough) {
    work_.add(190);
    Strip strip;
    if (take_strip(first_column, front, strip)) {
      refit(first_column, strip, roughly);
      continue;
    }
    if (!roughly) sample_noise(first_column);
    next_span_.fill(0);
    return true;
  }
  return false;
}

// Rows top, top + stride ... of a strip are looked at, from the plane as it is: w = plane . (x, t, 1), t the row from
// top. What is summed over them stays small, so that single precision is enough.
struct SpanBoundaries::StripRows {
  std::int32_t top, bottom, stride;
  double y0, pitch;
  Vec3 plane;
  [[nodiscard]] bool none() const noexcept { return top > bottom; }
};

// Over a strip, each column's for itself: of g, t, r the residual, x the column's ray.
struct SpanBoundaries::StripSums {
  enum Sum : std::size_t { kG, kGx, kGxx, kGt, kGtx, kGtt, kGr, kGrx, kGtr, kOff2, kCount, kSeen, kSums };
  std::array<Slots, kSums> of;
  [[nodiscard]] double total(Sum sum) const noexcept { return static_cast<double>(sum_of(of[sum])); }
};

SpanBoundaries::StripRows SpanBoundaries::rows_of(const Strip& strip, bool roughly) const noexcept {
  const Eight tops = cv::v_load(strip.top.data()), bottoms = cv::v_load(strip.bottom.data());
  const std::int32_t rows = cv::v_reduce_max(bottoms - tops) + 1;
  const Eight none = tops > bottoms;
  const std::int32_t top = cv::v_reduce_min(cv::v_select(none, cv::v_setall_s16(kDepthHeight_px), tops));
  const std::int32_t bottom = cv::v_reduce_max(cv::v_select(none, cv::v_setall_s16(-1), bottoms));
  if (rows == 0) return {0, -1, 1, 0.0, 0.0, Vec3::Zero()};
  // A tall strip has rows to spare: neighbours say nearly the same.
  const std::int32_t stride = (roughly && rows > 12 ? 2 : 1) * (rows > 64 ? 3 : (rows > 24 ? 2 : 1));
  const Vec3& m = planes_[strip.plane].plane.m;
  const double y0 = static_cast<double>(rays_->y[static_cast<std::size_t>(top)]), pitch = 1.0 / fy_px_;
  return {top, bottom, stride, y0, pitch, {m.x(), m.y() * pitch, m.y() * y0 + m.z()}};
}

void SpanBoundaries::add_up(std::int32_t first_column, const Strip& strip, const StripRows& rows,
                            StripSums& sums) const noexcept {
  static_assert(kRefitColumns % Wide::nlanes == 0 && kColumns % kRefitColumns == 0);
  Slots from{}, to{};
  for (std::size_t k = 0; k < kRefitColumns; ++k) {
    from[k] = static_cast<float>(strip.top[k] - rows.top);
    to[k] = static_cast<float>(strip.bottom[k] - rows.top);
  }
  const Wide least = all(1e-3F), one = all(1.0F), b = all(rows.plane.y()), next_row = all(rows.stride);
  const Wide most = all(math::square(params_.inlier_sigmas) * planes_[strip.plane].plane.m.squaredNorm());
  const InverseSigma<Wide> sigma_of = all(inverse_sigma_);
  const MeanShare<Wide> share = all(mean_share_);
  for (std::int32_t k = 0; k < kRefitColumns; k += Wide::nlanes) {
    const Wide first = cv::vx_load(from.data() + k), last = cv::vx_load(to.data() + k);
    const Wide x = cv::vx_load(rays_->x.data() + first_column + k), a = all(rows.plane.x()) * x + all(rows.plane.z());
    Wide sum_n = all(0.0F), sum_t = sum_n, sum_tt = sum_n, sum_r = sum_n, sum_tr = sum_n;
    Wide sum_off2 = sum_n, sum_count = sum_n, sum_seen = sum_n;
    Wide t = all(0.0F);
    for (std::int32_t r = rows.top; r <= rows.bottom; r += rows.stride, t += next_row) {
      const Wide w = cv::v_max(cv::vx_load(image_->inverse_depth.row(r) + first_column + k), least);
      const Wide pixels = simd::load_u8(image_->valid.row(r) + first_column + k);
      const Wide residual = w - (a + b * t), sigma = sigma_of(w);
      const Wide w2 = w * w, variance = sigma * sigma, residual2 = residual * residual;
      // Without pixels nothing counts.
      const Wide seen = pixels & (t >= first) & (t <= last);
      const Wide used = seen & (residual2 * w2 * pixels <= most * variance * share.times(pixels));
      const Wide inverse = used / (variance * w2);
      const Wide g = w2 * w2 * inverse, gt = g * t, gr = g * residual;
      sum_n += g, sum_t += gt, sum_tt += gt * t, sum_r += gr, sum_tr += gr * t;
      sum_off2 += residual2 * variance * inverse;
      sum_count += used, sum_seen += seen;
    }
    // Weights so far are per squared relative depth; |m|^2 |ray|^2 makes them 1 / sigma^2.
    const Wide y = all(rows.y0) + all(0.5 * rows.pitch) * (first + last), scale = one / (x * x + y * y + one);
    const auto put = [&](StripSums::Sum sum, const Wide& value) { cv::v_store(sums.of[sum].data() + k, value); };
    const Wide g = scale * sum_n, gt = scale * sum_t, gr = scale * sum_r, gx = g * x;
    put(StripSums::kG, g), put(StripSums::kGx, gx), put(StripSums::kGxx, gx * x);
    put(StripSums::kGt, gt), put(StripSums::kGtx, gt * x), put(StripSums::kGtt, scale * sum_tt);
    put(StripSums::kGr, gr), put(StripSums::kGrx, gr * x), put(StripSums::kGtr, scale * sum_tr);
    put(StripSums::kOff2, sum_off2), put(StripSums::kCount, sum_count), put(StripSums::kSeen, sum_seen);
  }
}

void SpanBoundaries::refit(std::int32_t first_column, const Strip& strip, bool roughly) noexcept {
  const StripRows rows = rows_of(strip, roughly);
  work_.add(90);
  if (rows.none()) return;
  work_.add(880 + 84 * ((rows.bottom - rows.top) / rows.stride + 1));
  StripSums sums;
  add_up(first_column, strip, rows, sums);
  Plane& plane = planes_[strip.plane];
  const double weight = rows.stride * math::square(plane.plane.d_m());
  const auto weighted = [&](StripSums::Sum sum) { return weight * sums.total(sum); };
  PlaneMoments m;
  m.one = weighted(StripSums::kG), m.x1 = weighted(StripSums::kGx), m.xx = weighted(StripSums::kGxx);
  m.y1 = weighted(StripSums::kGt), m.xy = weighted(StripSums::kGtx), m.yy = weighted(StripSums::kGtt);
  m.w1 = weighted(StripSums::kGr), m.xw = weighted(StripSums::kGrx), m.yw = weighted(StripSums::kGtr);
  m.count = rows.stride * sums.total(StripSums::kCount);
  plane.moments.add(m.moved(rows.y0, rows.pitch, rows.plane));
  plane.residual2 += weighted(StripSums::kOff2);
  plane.seen_px += rows.stride * sums.total(StripSums::kSeen);
}

// One column of each strip and every fourth row are enough for a median.
void SpanBoundaries::sample_noise(std::int32_t column) noexcept {
  constexpr std::int32_t kStride = 4;
  for (const ColumnSpan& span : columns_[static_cast<std::size_t>(column)]) {
    const Line line = line_of(span.plane, column);
    work_.add(50 + 80 * ((span.bottom - span.top + 2) / kStride));
    for (std::int32_t r = span.top + 1; r < span.bottom; r += kStride) {
      const float w = image_->by_column(r, column);
      if (!(w > 0.0F)) continue;
      const Offset at = offset(line, column, r);
      noise_samples_.add(w, at.off2 / at.variance);
    }
  }
}

}  // namespace polygmap
