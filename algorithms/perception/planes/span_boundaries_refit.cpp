// SPDX-License-Identifier: Apache-2.0
// The planes' moments within their boundaries, and the noise that their rows show.
#include <algorithm>

#include "algorithms/perception/image/simd.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {
namespace {

// The same order of summing for every register width.
float sum_of(const std::array<float, SpanBoundaries::kRefitColumns>& lanes) noexcept {
  using Four = cv::v_float32x4;
  static_assert(SpanBoundaries::kRefitColumns == 2 * Four::nlanes);
  Four sum = cv::v_load(lanes.data()) + cv::v_load(lanes.data() + Four::nlanes);
  sum = sum + cv::v_rotate_left<1>(sum);
  sum = sum + cv::v_rotate_left<2>(sum);
  return cv::v_extract_n<3>(sum);
}

}  // namespace

void SpanBoundaries::begin_refit() noexcept {
  noise_samples_.clear();
  for (Plane& plane : planes_) {
    plane.moments = PlaneMoments{};
    plane.residual2 = 0.0;
    plane.seen_px = 0.0;
  }
}

void SpanBoundaries::refit(std::int32_t first_column, bool roughly) noexcept {
  constexpr std::int32_t kThick_px = 8;  // thicker surfaces do without the rows next to another
  if (!roughly) sample_noise(first_column);
  std::array<std::size_t, kRefitColumns> next{};
  const std::int32_t count = std::min(kRefitColumns, rays_->columns - first_column);
  // Down the columns together: the topmost span that is left, and with it those of its plane that are next elsewhere.
  for (;;) {
    Strip strip;
    std::int32_t topmost = rays_->height_px;
    for (std::int32_t k = 0; k < count; ++k) {
      const Column& spans = columns_[static_cast<std::size_t>(first_column + k)];
      const std::size_t i = next[static_cast<std::size_t>(k)];
      if (i == spans.size() || spans[i].top >= topmost) continue;
      topmost = spans[i].top;
      strip.plane = spans[i].plane;
    }
    if (topmost == rays_->height_px) return;
    for (std::int32_t k = 0; k < kRefitColumns; ++k) {
      const auto lane = static_cast<std::size_t>(k);
      strip.top[lane] = 1;
      strip.bottom[lane] = 0;
      if (k >= count) continue;
      const Column& spans = columns_[static_cast<std::size_t>(first_column + k)];
      if (next[lane] == spans.size() || spans[next[lane]].plane != strip.plane) continue;
      const ColumnSpan& span = spans[next[lane]++];
      const int margin = span.bottom - span.top >= kThick_px ? 1 : 0;
      strip.top[lane] = static_cast<std::int16_t>(span.top + margin);
      strip.bottom[lane] = static_cast<std::int16_t>(span.bottom - margin);
    }
    refit(first_column, strip, roughly);
  }
}

void SpanBoundaries::refit(std::int32_t first_column, const Strip& strip, bool roughly) noexcept {
  using Wide = cv::v_float32;
  using Lanes = std::array<float, kRefitColumns>;
  static_assert(kRefitColumns % Wide::nlanes == 0 && kColumns % kRefitColumns == 0);
  Plane& plane = planes_[strip.plane];
  std::int32_t top = rays_->height_px, bottom = 0, rows = 0;
  for (std::size_t k = 0; k < kRefitColumns; ++k) {
    if (strip.top[k] > strip.bottom[k]) continue;
    top = std::min<std::int32_t>(top, strip.top[k]);
    bottom = std::max<std::int32_t>(bottom, strip.bottom[k]);
    rows = std::max(rows, strip.bottom[k] - strip.top[k] + 1);
  }
  if (rows == 0) return;
  // A tall strip has rows to spare: neighbours say nearly the same.
  const std::int32_t stride = (roughly && rows > 12 ? 2 : 1) * (rows > 64 ? 3 : (rows > 24 ? 2 : 1));
  // Rows count from top, and inverse depths from the plane as it is: what is summed stays small, so that single
  // precision is enough.
  const Vec3& plane_m = plane.plane.m;
  const double y0 = static_cast<double>(rays_->y[static_cast<std::size_t>(top)]), pitch = 1.0 / fy_px_;
  const double a0 = plane_m.y() * y0 + plane_m.z(), b0 = plane_m.y() * pitch;  // of a column at x = 0
  Lanes from{}, to{};
  for (std::size_t k = 0; k < kRefitColumns; ++k) {
    from[k] = static_cast<float>(strip.top[k] - top);
    to[k] = static_cast<float>(strip.bottom[k] - top);
  }

  // Over the strip, each lane's for itself: of g, t the row from top, r the residual, x the column's ray.
  enum Sum : std::size_t { kG, kGx, kGxx, kGt, kGtx, kGtt, kGr, kGrx, kGtr, kOff2, kCount, kSeen, kSums };
  std::array<Lanes, kSums> sums;
  const auto all = [](float value) { return cv::vx_setall_f32(value); };
  const auto of = [&all](double value) { return all(static_cast<float>(value)); };
  const Wide least = all(1e-3F), base = all(base_), per_metre = all(per_metre_), one = all(1.0F);
  const Wide quadratic = all(quadratic_), share1 = all(correlated_share_), share0 = all(1.0F - correlated_share_);
  const Wide most = of(math::square(params_.inlier_sigmas) * plane_m.squaredNorm());
  const Wide b = of(b0), next_row = all(static_cast<float>(stride));
  for (std::int32_t k = 0; k < kRefitColumns; k += Wide::nlanes) {
    const Wide first = cv::vx_load(from.data() + k), last = cv::vx_load(to.data() + k);
    const Wide x = cv::vx_load(rays_->x.data() + first_column + k), a = of(plane_m.x()) * x + of(a0);
    Wide sum_n = all(0.0F), sum_t = sum_n, sum_tt = sum_n, sum_r = sum_n, sum_tr = sum_n;
    Wide sum_off2 = sum_n, sum_count = sum_n, sum_seen = sum_n;
    Wide t = all(0.0F);
    for (std::int32_t r = top; r <= bottom; r += stride, t += next_row) {
      const Wide w = cv::v_max(cv::vx_load(image_->inverse_depth.row(r) + first_column + k), least);
      const Wide pixels =
          cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand_q(image_->valid.row(r) + first_column + k)));
      const Wide residual = w - (a + b * t), sigma = (base * w + per_metre) * w + quadratic;
      const Wide w2 = w * w, variance = sigma * sigma, residual2 = residual * residual;
      // The mean of n pixels has (share1 + share0 / n) of a pixel's variance. Without pixels nothing counts.
      const Wide seen = pixels & (t >= first) & (t <= last);
      const Wide used = seen & (residual2 * w2 * pixels <= most * variance * (share1 * pixels + share0));
      const Wide inverse = used / (variance * w2);
      const Wide g = w2 * w2 * inverse, gt = g * t, gr = g * residual;
      sum_n += g, sum_t += gt, sum_tt += gt * t, sum_r += gr, sum_tr += gr * t;
      sum_off2 += residual2 * variance * inverse;
      sum_count += used, sum_seen += seen;
    }
    // Weights so far are per squared relative depth; |m|^2 |ray|^2 makes them 1 / sigma^2.
    const Wide y = of(y0) + of(0.5 * pitch) * (first + last), scale = one / (x * x + y * y + one);
    const auto put = [&](Sum sum, const Wide& value) { cv::v_store(sums[sum].data() + k, value); };
    const Wide g = scale * sum_n, gt = scale * sum_t, gr = scale * sum_r, gx = g * x;
    put(kG, g), put(kGx, gx), put(kGxx, gx * x), put(kGt, gt), put(kGtx, gt * x), put(kGtt, scale * sum_tt);
    put(kGr, gr), put(kGrx, gr * x), put(kGtr, scale * sum_tr);
    put(kOff2, sum_off2), put(kCount, sum_count), put(kSeen, sum_seen);
  }

  const auto total = [&sums](Sum sum) { return static_cast<double>(sum_of(sums[sum])); };
  const double d2 = math::square(plane.plane.d_m()), weight = stride * d2;
  const double g = weight * total(kG), gx = weight * total(kGx), gxx = weight * total(kGxx);
  const double gt = weight * total(kGt), gtx = weight * total(kGtx), gtt = weight * total(kGtt);
  // y = y0 + pitch t, w = residual + m.x x + a0 + b0 t.
  const double gy = y0 * g + pitch * gt, gw = weight * total(kGr) + plane_m.x() * gx + a0 * g + b0 * gt;
  PlaneMoments& m = plane.moments;
  m.xx += gxx, m.xy += y0 * gx + pitch * gtx, m.x1 += gx, m.one += g, m.y1 += gy;
  m.yy += y0 * gy + pitch * (y0 * gt + pitch * gtt);
  m.xw += weight * total(kGrx) + plane_m.x() * gxx + a0 * gx + b0 * gtx, m.w1 += gw;
  m.yw += y0 * gw + pitch * (weight * total(kGtr) + plane_m.x() * gtx + a0 * gt + b0 * gtt);
  m.count += stride * total(kCount);
  plane.residual2 += weight * total(kOff2);
  plane.seen_px += stride * total(kSeen);
}

// One column of each strip and every fourth row are enough for a median.
void SpanBoundaries::sample_noise(std::int32_t column) noexcept {
  constexpr std::int32_t kStride = 4;
  for (const ColumnSpan& span : columns_[static_cast<std::size_t>(column)]) {
    const Line line = line_of(span.plane, column);
    for (std::int32_t r = span.top + 1; r < span.bottom; r += kStride) {
      const float w = image_->down(r, column);
      if (!(w > 0.0F)) continue;
      const Offset at = offset(line, column, r);
      noise_samples_.add(w, at.off2 / at.variance);
    }
  }
}

}  // namespace polygmap
