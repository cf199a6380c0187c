// SPDX-License-Identifier: Apache-2.0
// The planes' moments within their boundaries, and the noise that their rows show.
#include <algorithm>

#include "algorithms/perception/surface_boundaries.hpp"
#include "algorithms/perception/vectors.hpp"

namespace polygmap {

void SurfaceBoundaries::begin_refit() noexcept {
  noise_samples_.clear();
  for (Plane& plane : planes_) {
    plane.moments = PlaneMoments{};
    plane.residual2 = 0.0;
    plane.seen_px = 0.0;
  }
}

void SurfaceBoundaries::refit(std::int32_t first_column, bool roughly) noexcept {
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

void SurfaceBoundaries::refit(std::int32_t first_column, const Strip& strip, bool roughly) noexcept {
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
  const double y0 = static_cast<double>(rays_->y[static_cast<std::size_t>(top)]), pitch = 1.0 / fy_px_;
  const auto slope = static_cast<float>(plane.plane.m.y() * pitch);
  Lanes at_top{}, from{}, to{};
  for (std::size_t k = 0; k < kRefitColumns; ++k) {
    const auto column = static_cast<std::size_t>(first_column) + k;
    const auto x = static_cast<double>(rays_->x[column]);
    at_top[k] = static_cast<float>(plane.plane.m.x() * x + plane.plane.m.y() * y0 + plane.plane.m.z());
    from[k] = static_cast<float>(strip.top[k] - top);
    to[k] = static_cast<float>(strip.bottom[k] - top);
  }

  Lanes n, t1, tt, r1, tr, off2, count, seen_px;
  const auto all = [](float value) { return cv::vx_setall_f32(value); };
  const Wide least = all(1e-3F), base = all(base_), per_metre = all(per_metre_), b = all(slope);
  const Wide quadratic = all(quadratic_), share1 = all(correlated_share_), share0 = all(1.0F - correlated_share_);
  const Wide most = all(static_cast<float>(math::square(params_.inlier_sigmas) * plane.plane.m.squaredNorm()));
  for (std::int32_t k = 0; k < kRefitColumns; k += Wide::nlanes) {
    const Wide first = cv::vx_load(from.data() + k), last = cv::vx_load(to.data() + k);
    const Wide a = cv::vx_load(at_top.data() + k);
    Wide sum_n = all(0.0F), sum_t = sum_n, sum_tt = sum_n, sum_r = sum_n, sum_tr = sum_n;
    Wide sum_off2 = sum_n, sum_count = sum_n, sum_seen = sum_n;
    for (std::int32_t r = top; r <= bottom; r += stride) {
      const Wide t = all(static_cast<float>(r - top));
      const Wide w = cv::v_max(cv::vx_load(image_->inverse_depth.row(r) + first_column + k), least);
      const Wide pixels =
          cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand_q(image_->valid.row(r) + first_column + k)));
      const Wide residual = w - (a + b * t), sigma = (base * w + per_metre) * w + quadratic;
      const Wide w2 = w * w, variance = sigma * sigma;
      // The mean of n pixels has (share1 + share0 / n) of a pixel's variance. Without pixels nothing counts.
      const Wide seen = pixels & (t >= first) & (t <= last);
      const Wide used = seen & (residual * residual * w2 * pixels <= most * variance * (share1 * pixels + share0));
      const Wide g = used * w2 / variance;
      const Wide gt = g * t, gr = g * residual;
      const Wide relative = residual / w;
      sum_n += g, sum_t += gt, sum_tt += gt * t, sum_r += gr, sum_tr += gr * t;
      sum_off2 += used * relative * relative;
      sum_count += used, sum_seen += seen;
    }
    cv::v_store(n.data() + k, sum_n), cv::v_store(t1.data() + k, sum_t), cv::v_store(tt.data() + k, sum_tt);
    cv::v_store(r1.data() + k, sum_r), cv::v_store(tr.data() + k, sum_tr);
    cv::v_store(off2.data() + k, sum_off2), cv::v_store(count.data() + k, sum_count);
    cv::v_store(seen_px.data() + k, sum_seen);
  }

  const double d_m = plane.plane.d_m();
  for (std::size_t k = 0; k < kRefitColumns; ++k) {
    plane.seen_px += stride * static_cast<double>(seen_px[k]);
    if (!(count[k] > 0.0F)) continue;
    const auto x = static_cast<double>(rays_->x[static_cast<std::size_t>(first_column) + k]);
    const double middle = static_cast<double>(rays_->y[static_cast<std::size_t>((strip.top[k] + strip.bottom[k]) / 2)]);
    // Weights so far are per squared relative depth; |m|^2 |ray|^2 makes them 1 / sigma^2.
    const double scale = stride * d_m * d_m / (x * x + middle * middle + 1.0);
    const auto of = [scale](float sum) { return scale * static_cast<double>(sum); };
    // y = y0 + pitch t, w = residual + a + b t.
    const auto a0 = static_cast<double>(at_top[k]), b0 = static_cast<double>(slope);
    const double g = of(n[k]), gt = of(t1[k]), gtt = of(tt[k]);
    const double gw = of(r1[k]) + a0 * g + b0 * gt, gtw = of(tr[k]) + a0 * gt + b0 * gtt;
    const double gy = y0 * g + pitch * gt;
    PlaneMoments& m = plane.moments;
    m.xx += x * x * g, m.xy += x * gy, m.x1 += x * g, m.one += g, m.y1 += gy;
    m.yy += y0 * gy + pitch * (y0 * gt + pitch * gtt);
    m.xw += x * gw, m.w1 += gw, m.yw += y0 * gw + pitch * gtw;
    m.count += stride * static_cast<double>(count[k]);
    plane.residual2 += stride * d_m * d_m * static_cast<double>(off2[k]);
  }
}

// One column of each strip and every fourth row are enough for a median.
void SurfaceBoundaries::sample_noise(std::int32_t column) noexcept {
  constexpr std::int32_t kStride = 4;
  for (const ColumnSpan& span : columns_[static_cast<std::size_t>(column)]) {
    const Line line = line_of(planes_[span.plane].plane, column);
    for (std::int32_t r = span.top + 1; r < span.bottom; r += kStride) {
      const float w = image_->down(r, column);
      if (!(w > 0.0F)) continue;
      const Offset at = offset(line, column, r);
      noise_samples_.add(w, at.off2 / at.variance);
    }
  }
}

}  // namespace polygmap
