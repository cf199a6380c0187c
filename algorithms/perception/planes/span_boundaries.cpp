// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/span_boundaries.hpp"

#include <algorithm>
#include <bit>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
void SpanBoundaries::begin(const Params& params, const DepthNoiseModel& noise, const ColumnRays& rays, double fy_px,
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

void SpanBoundaries::build_spans(std::int32_t column, const ScanlineSegmentation::Column& runs,
                                 const std::array<std::uint8_t, kMaxPlanes + 1>& to_plane) noexcept {
  constexpr int kElsewhere = 3;
  Column& out = columns_[static_cast<std::size_t>(column)];
  out.clear();
  for (const Run& run : runs) {
    const std::uint8_t plane = run.plane <= kMaxPlanes ? to_plane[run.plane] : std::uint8_t{0};
    if (plane == 0) continue;
    if (!out.empty() && out.back().plane == plane) {
      const Line line = line_of(plane, column);
      int other = 0, own = 0;
      for (std::int32_t r = out.back().bottom + 1; r < run.top; ++r) {
        const float w = image_->down(r, column);
        const float off = std::abs(w - (line.a + line.b * rays_->y[static_cast<std::size_t>(r)])) * w;
        const float limit = (static_cast<float>(params_.same_gap_sigmas) * inverse_sigma(w) +
                             static_cast<float>(params_.gap_floor_m) * w * w) *
                            line.norm;
        const int measured = static_cast<int>(w > 0.0F), is_off = measured & static_cast<int>(off > limit);
        other += is_off, own += measured - is_off;
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

void SpanBoundaries::trim_ends(std::int32_t column) noexcept {
  for (ColumnSpan& span : columns_[static_cast<std::size_t>(column)]) trim_ends(column, span);
}

void SpanBoundaries::trim_ends(std::int32_t column, ColumnSpan& interval) const noexcept {
  constexpr std::int32_t kMost_px = kRowsAtOnce, kGood = 2;
  const Line line = line_of(interval.plane, column);
  if (interval.bottom - interval.top + 1 >= kRowsAtOnce) {
    constexpr std::uint32_t kAll = (1U << kRowsAtOnce) - 1U;
    const Rows upper = fitting(line, column, interval.top);
    const Rows lower = fitting(line, column, interval.bottom - kRowsAtOnce + 1);
    if ((upper.measured & lower.measured) == kAll) {  // the first two good ones next to each other, if there are any
      const std::uint32_t from_top = upper.fit & upper.fit >> 1, from_bottom = lower.fit & lower.fit >> 1;
      if (from_top != 0) interval.top = static_cast<std::int16_t>(interval.top + std::countr_zero(from_top));
      if (from_bottom != 0) {
        const auto rows = static_cast<std::int32_t>(std::bit_width(from_bottom));
        interval.bottom = static_cast<std::int16_t>(interval.bottom - kRowsAtOnce + 1 + rows);
      }
      return;
    }
  }
  const auto cut = [&](std::int32_t from, std::int32_t step) {
    std::int32_t at = from, good = 0;
    for (std::int32_t i = 0; i < kMost_px && good < kGood; ++i) {
      const std::int32_t r = from + i * step;
      if (r < interval.top || r > interval.bottom) return from;
      if (!(image_->down(r, column) > 0.0F)) continue;
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

void SpanBoundaries::begin_scores() noexcept {
  joint_count_ = 0;
  pair_count_ = 0;
  for (auto& lower : pair_of_) lower.fill(kMaxPairs);
}

std::uint8_t SpanBoundaries::pair_of(std::uint8_t upper, std::uint8_t lower) noexcept {
  std::uint8_t& index = pair_of_[upper][lower];
  if (index < kMaxPairs) return index;
  if (pair_count_ == kMaxPairs) {
    ++overflow_;
    return kMaxPairs;
  }
  index = static_cast<std::uint8_t>(pair_count_++);
  Pair& pair = pairs_[index];
  pair.upper = upper;
  pair.lower = lower;
  pair.columns = 0.0;
  for (auto& gain : pair.gain) gain.fill(0.0F);
  return index;
}

// Grows one end while rows without data or two rows off the plane do not stop it.
void SpanBoundaries::extend(std::int32_t column, ColumnSpan& interval, std::int32_t step, std::int32_t limit) noexcept {
  constexpr int kMaxEmpty = 3;
  const Line line = line_of(interval.plane, column);
  const auto most = static_cast<float>(math::square(params_.inlier_sigmas));
  std::int16_t& end = step > 0 ? interval.bottom : interval.top;
  int empty = 0, off = 0;
  for (std::int32_t r = end + step; step > 0 ? r <= limit : r >= limit; r += step) {
    if (!(image_->down(r, column) > 0.0F)) {
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
std::int32_t SpanBoundaries::change_point(std::int32_t column, const Line& upper, const Line& lower, std::int32_t first,
                                          std::int32_t last, float meeting_row, Pair* pair) const noexcept {
  using Wide = cv::v_float32;
  using Four = cv::v_float32x4;
  constexpr std::int32_t kAtOnce = kRowsAtOnce;
  static_assert(kAtOnce % Wide::nlanes == 0 && kAtOnce % Four::nlanes == 0);
  static constexpr std::array<float, kAtOnce> kSteps{0, 1, 2, 3, 4, 5, 6, 7};
  const auto all = [](float x) { return cv::vx_setall_f32(x); };
  // One sigma for both: with each its own, the boundary drifts towards the less noisy plane.
  const Wide norm2 = all(upper.norm * lower.norm), zero = all(0.0F), most = all(kTruncation);
  const Wide share1 = all(correlated_share_), share0 = all(1.0F - correlated_share_);
  float* bins = nullptr;
  std::int32_t bin = 0;  // a row further is a bin further
  if (pair != nullptr) {
    const auto half_px = static_cast<std::int32_t>(std::floor(2.0F * (static_cast<float>(first) - meeting_row)));
    bins = pair->gain[static_cast<std::size_t>(half_px & 1)].data();
    bin = (half_px >> 1) + kBins / 2;
  }
  const float *ws = image_->down.row(column), *ys = rays_->y.data();
  // Each lane's least sum so far and the first row that has it: which of them is least is asked at the end.
  const Four four_steps = cv::v_load(kSteps.data()), none = cv::v_setall_f32(static_cast<float>(first - 1));
  Four sum = cv::v_setzero_f32(), best = sum, at = none;
  for (std::int32_t from = first; from <= last; from += kAtOnce, bin += kAtOnce) {
    // The last rows of the picture are looked at with others before them.
    const std::int32_t start = std::min(from, kDepthHeight_px - kAtOnce);
    const Wide first_step = all(static_cast<float>(from - start)), last_step = all(static_cast<float>(last - start));
    std::array<float, kAtOnce> gains;
    for (std::int32_t i = 0; i < kAtOnce; i += Wide::nlanes) {
      const Wide w = cv::vx_load(ws + start + i), y = cv::vx_load(ys + start + i);
      const Wide off_upper = (w - (all(upper.a) + all(upper.b) * y)) * w;
      const Wide off_lower = (w - (all(lower.a) + all(lower.b) * y)) * w;
      const Wide sigma = (all(base_) * w + all(per_metre_)) * w + all(quadratic_);
      const Wide pixels =
          cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand_q(image_->valid_down.row(column) + start + i)));
      const Wide information = pixels / (sigma * sigma * norm2 * (share1 * pixels + share0));
      const Wide gain =
          cv::v_min(off_upper * off_upper * information, most) - cv::v_min(off_lower * off_lower * information, most);
      // Nothing where there is no data.
      const Wide step = cv::vx_load(kSteps.data() + i);
      cv::v_store(gains.data() + i, gain & (w > zero) & (step >= first_step) & (step <= last_step));
    }
    for (std::int32_t i = 0; i < kAtOnce; i += Four::nlanes) {
      Four sums = cv::v_load(gains.data() + i);
      sums = sums + cv::v_rotate_left<1>(sums);
      sums = sums + cv::v_rotate_left<2>(sums) + sum;
      sum = cv::v_broadcast_element<3>(sums);
      const Four row = cv::v_setall_f32(static_cast<float>(start + i)) + four_steps;
      const Four better = (sums < best) & (row >= cv::v_setall_f32(static_cast<float>(from)));
      best = cv::v_select(better, sums, best);
      at = cv::v_select(better, row, at);
    }
    const std::int32_t first_bin = bin - (from - start);
    if (bins == nullptr || first_bin < -kAtOnce || first_bin > kBins) continue;
    for (std::int32_t i = 0; i < kAtOnce; i += Wide::nlanes) {
      float* to = bins + kAtOnce + first_bin + i;
      cv::v_store(to, cv::vx_load(to) + cv::vx_load(gains.data() + i));
    }
  }
  const Four least = best == cv::v_setall_f32(cv::v_reduce_min(best));
  return static_cast<std::int32_t>(cv::v_reduce_min(cv::v_select(least, at, cv::v_setall_f32(kDepthHeight_px))));
}

void SpanBoundaries::score(std::int32_t column, bool by_planes) noexcept {
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
    const Line a = line_of(upper.plane, column), b = line_of(lower.plane, column);
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
    const std::uint8_t i = meets && joint_count_ < kMaxJoints ? pair_of(upper.plane, lower.plane) : kMaxPairs;
    Pair* pair = i == kMaxPairs ? nullptr : &pairs_[i];
    if (pair != nullptr) {
      pair->columns += 1.0;
      joints_[joint_count_++] = {static_cast<std::int16_t>(column), i, static_cast<std::uint8_t>(k)};
    }
    const std::int32_t own = change_point(column, a, b, first, last, static_cast<float>(row), pair);
    upper.bottom = static_cast<std::int16_t>(std::clamp<std::int32_t>(own, upper.top, lower.bottom - 1));
    lower.top = static_cast<std::int16_t>(upper.bottom + 1);
  }
}

void SpanBoundaries::place() noexcept {
  for (std::size_t i = 0; i < pair_count_; ++i) {
    double sum = 0.0, best = 0.0, meeting = 0.0;
    std::size_t at = 0;  // half bins above the boundary
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      if (bin == kBins / 2) meeting = sum;
      for (std::size_t half = 0; half < 2; ++half) {
        sum += static_cast<double>(pairs_[i].gain[half][kRowsAtOnce + bin]);
        if (sum >= best) continue;
        best = sum;
        at = 2 * bin + half + 1;
      }
    }
    const double offset_px = 0.5 * static_cast<double>(at) - 0.5 * kBins;
    const bool meets = std::abs(offset_px) < params_.meet_px || meeting - best < params_.meet_gain * pairs_[i].columns;
    pairs_[i].shift_px = meets ? 0.0 : offset_px;
  }
  reproject();
}

void SpanBoundaries::reproject() noexcept {
  for (std::size_t i = 0; i < joint_count_; ++i) {
    const Joint& joint = joints_[i];
    Column& intervals = columns_[static_cast<std::size_t>(joint.column)];
    ColumnSpan &upper = intervals[joint.upper], &lower = intervals[joint.upper + 1U];
    const Line a = line_of(upper.plane, joint.column), b = line_of(lower.plane, joint.column);
    const double row = std::ceil(meeting_row(a, b) + pairs_[joint.pair].shift_px) - 1.0;
    if (!std::isfinite(row)) continue;
    upper.bottom = static_cast<std::int16_t>(math::clamp(row, upper.top, lower.bottom - 1.0));
    lower.top = static_cast<std::int16_t>(upper.bottom + 1);
  }
}

}  // namespace polygmap
