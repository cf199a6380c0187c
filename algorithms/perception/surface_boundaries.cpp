// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_boundaries.hpp"

#include <algorithm>

#include "algorithms/perception/vectors.hpp"

namespace polygmap {
namespace {

constexpr float kTruncation = 9.0F;  // of a cost: an outlier says no more than three sigmas do

}  // namespace

void SurfaceBoundaries::begin(const Params& params, const DepthSigma& noise, const ColumnRays& rays, double fy_px,
                              double cy_px, const ColumnImage& image) noexcept {
  params_ = params;
  rays_ = &rays;
  image_ = &image;
  fy_px_ = fy_px;
  cy_px_ = cy_px;
  base_ = static_cast<float>(noise.base_m);
  per_metre_ = static_cast<float>(noise.per_metre);
  quadratic_ = static_cast<float>(noise.quadratic_per_m);
  correlated_share_ = static_cast<float>(noise.correlated_share);
  share_[0] = 1.0F;
  for (std::size_t n = 1; n < share_.size(); ++n) {
    share_[n] = static_cast<float>(noise.correlated_share + (1.0 - noise.correlated_share) / static_cast<double>(n));
  }
  for (Plane& plane : planes_) plane = Plane{};
  overflow_ = 0;
}

SurfaceBoundaries::Line SurfaceBoundaries::line_of(const InversePlane& plane, std::int32_t column) const noexcept {
  const auto x = static_cast<double>(rays_->x[static_cast<std::size_t>(column)]);
  return {static_cast<float>(plane.m.x() * x + plane.m.z()), static_cast<float>(plane.m.y()),
          static_cast<float>(plane.m.norm())};
}

SurfaceBoundaries::Offset SurfaceBoundaries::offset(const Line& line, std::int32_t column,
                                                    std::int32_t row) const noexcept {
  const float w = image_->inverse_depth(column, row);
  const float residual = (w - (line.a + line.b * rays_->y[static_cast<std::size_t>(row)])) * w;
  const float sigma = inverse_sigma(w) * line.norm;
  return {residual * residual, sigma * sigma * share_[image_->valid(column, row)]};
}

void SurfaceBoundaries::gather(std::int32_t column, const RunSegmentation::Column& runs,
                               const std::array<std::uint8_t, kMaxPlanes + 1>& to_plane) noexcept {
  constexpr int kElsewhere = 3;
  Column& out = columns_[static_cast<std::size_t>(column)];
  out.clear();
  for (const Run& run : runs) {
    const std::uint8_t plane = run.plane <= kMaxPlanes ? to_plane[run.plane] : std::uint8_t{0};
    if (plane == 0) continue;
    if (!out.empty() && out.back().plane == plane) {
      const Line line = line_of(planes_[plane].plane, column);
      int other = 0, own = 0;
      for (std::int32_t r = out.back().bottom + 1; r < run.top; ++r) {
        const float w = image_->inverse_depth(column, r);
        if (!(w > 0.0F)) continue;
        const float off = std::abs(w - (line.a + line.b * rays_->y[static_cast<std::size_t>(r)])) * w;
        const float limit = (static_cast<float>(params_.same_gap_sigmas) * inverse_sigma(w) +
                             static_cast<float>(params_.gap_floor_m) * w * w) *
                            line.norm;
        ++(off > limit ? other : own);
      }
      if (other < kElsewhere || 2 * other < own) {
        out.back().bottom = run.bottom;
        continue;
      }
    }
    ColumnSpan interval;
    interval.top = run.top;
    interval.bottom = run.bottom;
    interval.plane = plane;
    if (!out.try_push_back(interval)) ++overflow_;
  }
}

void SurfaceBoundaries::trim(std::int32_t column) noexcept {
  for (ColumnSpan& span : columns_[static_cast<std::size_t>(column)]) trim(column, span);
}

void SurfaceBoundaries::trim(std::int32_t column, ColumnSpan& interval) const noexcept {
  constexpr std::int32_t kMost_px = 8, kGood = 2;
  const Line line = line_of(planes_[interval.plane].plane, column);
  const auto cut = [&](std::int32_t from, std::int32_t step) {
    std::int32_t at = from, good = 0;
    for (std::int32_t i = 0; i < kMost_px && good < kGood; ++i) {
      const std::int32_t r = from + i * step;
      if (r < interval.top || r > interval.bottom) return from;
      if (image_->valid(column, r) == 0) continue;
      if (!offset(line, column, r).within(kTruncation)) {
        good = 0;
        at = r + step;
      } else {
        ++good;
      }
    }
    return good == kGood ? at : from;
  };
  interval.top = static_cast<std::int16_t>(cut(interval.top, 1));
  interval.bottom = static_cast<std::int16_t>(cut(interval.bottom, -1));
}

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
    const auto consider = [&](std::uint8_t plane, std::int32_t top, std::int32_t bottom) {
      if (plane == above || plane == below || bottom - top < most) return;
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

void SurfaceBoundaries::begin_meeting() noexcept {
  joint_count_ = 0;
  pair_count_ = 0;
}

std::uint16_t SurfaceBoundaries::pair_of(std::uint8_t upper, std::uint8_t lower) noexcept {
  for (std::size_t i = 0; i < pair_count_; ++i) {
    if (pairs_[i].upper == upper && pairs_[i].lower == lower) return static_cast<std::uint16_t>(i);
  }
  if (pair_count_ == kMaxPairs) {
    ++overflow_;
    return kMaxPairs;
  }
  Pair& pair = pairs_[pair_count_];
  pair.upper = upper;
  pair.lower = lower;
  pair.columns = 0.0;
  pair.gain.fill(0.0F);
  return static_cast<std::uint16_t>(pair_count_++);
}

// Grows one end while rows without data or two rows off the plane do not stop it.
void SurfaceBoundaries::extend(std::int32_t column, ColumnSpan& interval, std::int32_t step,
                               std::int32_t limit) noexcept {
  constexpr int kMaxEmpty = 3;
  const Line line = line_of(planes_[interval.plane].plane, column);
  const auto most = static_cast<float>(math::square(params_.inlier_sigmas));
  std::int16_t& end = step > 0 ? interval.bottom : interval.top;
  int empty = 0, off = 0;
  for (std::int32_t r = end + step; step > 0 ? r <= limit : r >= limit; r += step) {
    if (image_->valid(column, r) == 0) {
      if (++empty > kMaxEmpty) return;
    } else if (offset(line, column, r).within(most)) {
      end = static_cast<std::int16_t>(r);
      empty = off = 0;
    } else if (++off > 1) {
      return;
    }
  }
}

// Rows first .. last belong to either; the last row of the upper one, first - 1 when all are the lower one's. What the
// rows say goes into the pair, too, if there is one.
std::int32_t SurfaceBoundaries::change_point(std::int32_t column, const Line& upper, const Line& lower,
                                             std::int32_t first, std::int32_t last, float meeting_row,
                                             Pair* pair) const noexcept {
  // One sigma for both: with each its own, the boundary drifts towards the less noisy plane.
  const float norm2 = upper.norm * lower.norm;
  const auto to_bin = [&](std::int32_t r) {
    return static_cast<std::int32_t>(
               std::floor((static_cast<float>(r) - meeting_row) * static_cast<float>(kBinsPerPixel))) +
           kBins / 2;
  };
  constexpr std::int32_t kNowhere = -1000000;
  std::int32_t bin = pair != nullptr ? to_bin(first) : kNowhere;  // a row further is kBinsPerPixel bins further
  float sum = 0.0F, best = 0.0F;
  std::int32_t at = first - 1;
  for (std::int32_t r = first; r <= last; ++r, bin += kBinsPerPixel) {
    const std::size_t valid = image_->valid(column, r);
    if (valid == 0) continue;
    const float w = image_->inverse_depth(column, r), y = rays_->y[static_cast<std::size_t>(r)];
    const float off_upper = (w - (upper.a + upper.b * y)) * w, off_lower = (w - (lower.a + lower.b * y)) * w;
    const float sigma = inverse_sigma(w), information = 1.0F / (sigma * sigma * norm2 * share_[valid]);
    const float gain = std::min(off_upper * off_upper * information, kTruncation) -
                       std::min(off_lower * off_lower * information, kTruncation);
    sum += gain;
    if (sum < best) {
      best = sum;
      at = r;
    }
    if (bin >= 0 && bin < kBins) pair->gain[static_cast<std::size_t>(bin)] += gain;
  }
  return at;
}

void SurfaceBoundaries::meet(std::int32_t column, bool by_planes) noexcept {
  Column& intervals = columns_[static_cast<std::size_t>(column)];
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    ColumnSpan& upper = intervals[k];
    if (k == 0) extend(column, upper, -1, 0);
    if (k + 1 == intervals.size()) {
      extend(column, upper, 1, rays_->height_px - 1);
      break;
    }
    ColumnSpan& lower = intervals[k + 1];
    if (upper.plane == lower.plane || lower.top - upper.bottom > params_.max_gap_px) {
      extend(column, upper, 1, lower.top - 1);
      extend(column, lower, -1, upper.bottom + 1);
      continue;
    }
    const Line a = line_of(planes_[upper.plane].plane, column), b = line_of(planes_[lower.plane].plane, column);
    const double row = meeting_row(a, b);
    const std::int32_t window = params_.window_px;
    std::int32_t first = upper.bottom, last = lower.top;
    const bool meets = row > first - window && row < last + window;  // false for parallel planes, too
    if (meets && by_planes) {
      upper.bottom = static_cast<std::int16_t>(math::clamp(std::ceil(row) - 1.0, upper.top, lower.bottom - 1.0));
      lower.top = static_cast<std::int16_t>(upper.bottom + 1);
      continue;
    }
    if (meets) {
      first = std::min(first, static_cast<std::int32_t>(row));
      last = std::max(last, static_cast<std::int32_t>(row) + 1);
    }
    first = std::max<std::int32_t>(first - window, upper.top);
    last = std::min<std::int32_t>(last + window, lower.bottom);
    overflow_ += meets && joint_count_ == kMaxJoints ? 1U : 0U;
    const std::uint16_t i = meets && joint_count_ < kMaxJoints ? pair_of(upper.plane, lower.plane) : kMaxPairs;
    Pair* pair = i == kMaxPairs ? nullptr : &pairs_[i];
    if (pair != nullptr) {
      pair->columns += 1.0;
      joints_[joint_count_++] = {i, static_cast<std::int16_t>(column), static_cast<std::uint8_t>(k)};
    }
    const std::int32_t own = change_point(column, a, b, first, last, static_cast<float>(row), pair);
    upper.bottom = static_cast<std::int16_t>(std::clamp<std::int32_t>(own, upper.top, lower.bottom - 1));
    lower.top = static_cast<std::int16_t>(upper.bottom + 1);
  }
}

void SurfaceBoundaries::settle() noexcept {
  for (std::size_t i = 0; i < pair_count_; ++i) {
    double sum = 0.0, best = 0.0, meeting = 0.0;
    std::int32_t at = 0;  // bins above the boundary
    for (std::int32_t bin = 0; bin < kBins; ++bin) {
      if (bin == kBins / 2) meeting = sum;
      sum += static_cast<double>(pairs_[i].gain[static_cast<std::size_t>(bin)]);
      if (sum >= best) continue;
      best = sum;
      at = bin + 1;
    }
    const double offset_px = (at - 0.5 * kBins) / kBinsPerPixel;
    const bool meets = std::abs(offset_px) < params_.meet_px || meeting - best < params_.meet_gain * pairs_[i].columns;
    pairs_[i].shift_px = meets ? 0.0 : offset_px;
  }
  follow();
}

void SurfaceBoundaries::follow() noexcept {
  for (std::size_t i = 0; i < joint_count_; ++i) {
    const Joint& joint = joints_[i];
    Column& intervals = columns_[static_cast<std::size_t>(joint.column)];
    ColumnSpan &upper = intervals[joint.upper], &lower = intervals[joint.upper + 1U];
    const Line a = line_of(planes_[upper.plane].plane, joint.column),
               b = line_of(planes_[lower.plane].plane, joint.column);
    const double row = std::ceil(meeting_row(a, b) + pairs_[joint.pair].shift_px) - 1.0;
    if (!std::isfinite(row)) continue;
    upper.bottom = static_cast<std::int16_t>(math::clamp(row, upper.top, lower.bottom - 1.0));
    lower.top = static_cast<std::int16_t>(upper.bottom + 1);
  }
}

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
      if (image_->valid(column, r) == 0) continue;
      const Offset at = offset(line, column, r);
      noise_samples_.add(image_->inverse_depth(column, r), at.off2 / at.variance);
    }
  }
}

}  // namespace polygmap
