// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/span_boundaries.hpp"

#include <algorithm>
#include <bit>

#include "algorithms/perception/image/change_point.hpp"
#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

using simd::all, simd::Four, simd::Wide;

}  // namespace

void SpanBoundaries::begin(const Params& params, const DepthNoiseModel& noise, const ColumnRays& rays, double fy_px,
                           double cy_px, const ColumnImage& image) noexcept {
  params_ = params;
  rays_ = &rays;
  image_ = &image;
  fy_px_ = fy_px;
  cy_px_ = cy_px;
  inverse_sigma_ = noise.inverse_sigma_f();
  mean_share_ = noise.mean_share_f();
  share_[0] = 1.0F;
  for (std::size_t n = 1; n < share_.size(); ++n) {
    share_[n] = static_cast<float>(noise.mean_share(static_cast<double>(n)));
  }
  for (Plane& plane : planes_) plane = Plane{};
  overflow_ = 0;
}

void SpanBoundaries::build_spans(std::int32_t column, const ScanlineSegmentation::Column& segments,
                                 const std::array<std::uint8_t, kMaxPlanes + 1>& to_plane) noexcept {
  Column& out = columns_[static_cast<std::size_t>(column)];
  out.clear();
  work_.add(60);
  for (const ScanlineSegment& segment : segments) {
    work_.add(32);
    const std::uint8_t plane = segment.plane <= kMaxPlanes ? to_plane[segment.plane] : std::uint8_t{0};
    if (plane == 0) continue;
    if (!out.empty() && out.back().plane == plane) {
      const Line line = line_of(plane, column);
      int other = 0, own = 0;
      work_.add(60 + 17 * std::max(segment.top - out.back().bottom, 0));
      for (std::int32_t r = out.back().bottom + 1; r < segment.top; ++r) {
        const float w = image_->by_column(r, column);
        const float off = std::abs(w - (line.a + line.b * rays_->y[static_cast<std::size_t>(r)])) * w;
        const float limit = (static_cast<float>(params_.same_gap_sigmas) * inverse_sigma_(w) +
                             static_cast<float>(params_.gap_floor_m) * w * w) *
                            line.norm;
        const int measured = static_cast<int>(w > 0.0F), is_off = measured & static_cast<int>(off > limit);
        other += is_off, own += measured - is_off;
      }
      if (other < params_.min_gap_rows || 2 * other < own) {
        out.back().bottom = segment.bottom;
        continue;
      }
    }
    ColumnSpan span;
    span.top = segment.top;
    span.bottom = segment.bottom;
    span.plane = plane;
    if (!out.try_push_back(span)) ++overflow_;
  }
}

void SpanBoundaries::trim_ends(std::int32_t column) noexcept {
  for (ColumnSpan& span : columns_[static_cast<std::size_t>(column)]) trim_ends(column, span);
}

void SpanBoundaries::trim_ends(std::int32_t column, ColumnSpan& span) noexcept {
  constexpr std::int32_t kMost_px = kRowsAtOnce, kGood = 2;  // rows looked at, and good ones next to each other
  const Line line = line_of(span.plane, column);
  work_.add(60);
  if (span.bottom - span.top + 1 >= kRowsAtOnce) {
    work_.add(210);
    constexpr std::uint32_t kAll = (1U << kRowsAtOnce) - 1U;
    const Rows upper = fitting(line, column, span.top);
    const Rows lower = fitting(line, column, span.bottom - kRowsAtOnce + 1);
    if ((upper.measured & lower.measured) == kAll) {  // the first two good ones next to each other, if there are any
      const std::uint32_t from_top = upper.fit & upper.fit >> 1, from_bottom = lower.fit & lower.fit >> 1;
      if (from_top != 0) span.top = static_cast<std::int16_t>(span.top + std::countr_zero(from_top));
      if (from_bottom != 0) {
        const auto rows = static_cast<std::int32_t>(std::bit_width(from_bottom));
        span.bottom = static_cast<std::int16_t>(span.bottom - kRowsAtOnce + 1 + rows);
      }
      return;
    }
  }
  work_.add(200);
  const auto cut = [&](std::int32_t from, std::int32_t step) {
    std::int32_t at = from, good = 0;
    for (std::int32_t i = 0; i < kMost_px && good < kGood; ++i) {
      const std::int32_t r = from + i * step;
      if (r < span.top || r > span.bottom) return from;
      if (!(image_->by_column(r, column) > 0.0F)) continue;
      if (!offset(line, column, r).within(kTruncation)) {
        good = 0;
        at = r + step;
      } else {
        ++good;
      }
    }
    return good == kGood ? at : from;
  };
  span.top = static_cast<std::int16_t>(cut(span.top, 1));
  span.bottom = static_cast<std::int16_t>(cut(span.bottom, -1));
}

void SpanBoundaries::begin_scores() noexcept {
  joint_count_ = 0;
  pair_count_ = 0;
  for (auto& lower : pair_of_) lower.fill(kMaxPairs);
  work_.add(pair_of_.size(), 16);
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
  work_.add(70);
  return index;
}

// Grows one end while rows without data or two rows off the plane do not stop it.
void SpanBoundaries::extend(std::int32_t column, ColumnSpan& span, std::int32_t step, std::int32_t limit) noexcept {
  const Line line = line_of(span.plane, column);
  const auto most = static_cast<float>(math::square(params_.inlier_sigmas));
  std::int16_t& end = step > 0 ? span.bottom : span.top;
  int empty = 0, off = 0;
  work_.add(50);
  for (std::int32_t r = end + step; step > 0 ? r <= limit : r >= limit; r += step) {
    work_.add(27);
    if (!(image_->by_column(r, column) > 0.0F)) {
      if (++empty > params_.max_empty_rows) return;
    } else if (offset(line, column, r).within(most)) {
      end = static_cast<std::int16_t>(r);
      empty = off = 0;
    } else if (++off > 1) {
      return;
    }
  }
}

// What each row of a column says for the lower of two planes: cost(upper) - cost(lower), nothing where there is no
// data.
struct SpanBoundaries::RowGains {
  using Eight = std::array<float, kRowsAtOnce>;
  const float *ws, *ys;
  const std::uint8_t* pixels_of;
  Wide upper_a, upper_b, lower_a, lower_b, norm2, zero = all(0.0F), most = all(kTruncation);
  InverseSigma<Wide> sigma_of;
  MeanShare<Wide> share;

  // One sigma for both: with each its own, the boundary drifts towards the less noisy plane.
  RowGains(const SpanBoundaries& s, std::int32_t column, const Line& upper, const Line& lower) noexcept
      : ws(s.image_->by_column.row(column)),
        ys(s.rays_->y.data()),
        pixels_of(s.image_->valid_by_column.row(column)),
        upper_a(all(upper.a)),
        upper_b(all(upper.b)),
        lower_a(all(lower.a)),
        lower_b(all(lower.b)),
        norm2(all(upper.norm * lower.norm)),
        sigma_of(all(s.inverse_sigma_)),
        share(all(s.mean_share_)) {}

  // Of kRowsAtOnce rows from start on; nothing of those that are not between first and last.
  void weigh(std::int32_t start, std::int32_t first, std::int32_t last, Eight& gains) const noexcept {
    static_assert(kRowsAtOnce % Wide::nlanes == 0);
    const Wide first_step = all(first - start), last_step = all(last - start);
    for (std::int32_t i = 0; i < kRowsAtOnce; i += Wide::nlanes) {
      const Wide w = cv::vx_load(ws + start + i), y = cv::vx_load(ys + start + i);
      const Wide off_upper = (w - (upper_a + upper_b * y)) * w, off_lower = (w - (lower_a + lower_b * y)) * w;
      const Wide sigma = sigma_of(w), pixels = simd::load_u8(pixels_of + start + i);
      const Wide information = pixels / (sigma * sigma * norm2 * share.times(pixels));
      const Wide gain =
          cv::v_min(off_upper * off_upper * information, most) - cv::v_min(off_lower * off_lower * information, most);
      const Wide step = simd::steps_from(i);
      cv::v_store(gains.data() + i, gain & (w > zero) & (step >= first_step) & (step <= last_step));
    }
  }
};

// Those of one column, into the sums of all columns in which two planes meet.
struct SpanBoundaries::BinnedGains {
  float* bins = nullptr;
  std::int32_t bin = 0;  // of row 0: a row further is a bin further

  BinnedGains(Pair* pair, float meeting_row, std::int32_t first) noexcept {
    if (pair == nullptr) return;
    const auto half_px = static_cast<std::int32_t>(std::floor(2.0F * (static_cast<float>(first) - meeting_row)));
    bins = pair->gain[static_cast<std::size_t>(half_px & 1)].data();
    bin = (half_px >> 1) + kBins / 2 - first;
  }
  void add(std::int32_t start, const RowGains::Eight& gains) const noexcept {
    const std::int32_t first_bin = bin + start;
    if (bins == nullptr || first_bin < -kRowsAtOnce || first_bin > kBins) return;
    for (std::int32_t i = 0; i < kRowsAtOnce; i += Wide::nlanes) {
      float* to = bins + kRowsAtOnce + first_bin + i;
      cv::v_store(to, cv::vx_load(to) + cv::vx_load(gains.data() + i));
    }
  }
};

// Rows first .. last belong to either; the last row of the upper one, first - 1 when all are the lower one's. What the
// rows say goes into the pair, too, if there is one.
std::int32_t SpanBoundaries::change_point(std::int32_t column, const Line& upper, const Line& lower, std::int32_t first,
                                          std::int32_t last, float meeting_row, Pair* pair) noexcept {
  static_assert(kRowsAtOnce % Four::nlanes == 0);
  work_.add(190 + 150 * ((last - first) / kRowsAtOnce + 1));
  const RowGains rows(*this, column, upper, lower);
  const BinnedGains binned(pair, meeting_row, first);
  const Four four_steps = cv::v_load(simd::kSteps.data()), zero = cv::v_setzero_f32();
  // Each slot's own least sum and the first row that has it: which of them is least is asked at the end.
  ChangePoint<Four> point{zero, zero, cv::v_setall_f32(static_cast<float>(first - 1))};
  for (std::int32_t from = first; from <= last; from += kRowsAtOnce) {
    // The last rows of the image are looked at with others before them.
    const std::int32_t start = std::min(from, kDepthHeight_px - kRowsAtOnce);
    RowGains::Eight gains;
    rows.weigh(start, from, last, gains);
    for (std::int32_t i = 0; i < kRowsAtOnce; i += Four::nlanes) {
      const Four sums = simd::running_sums(cv::v_load(gains.data() + i), point.sum);
      const Four row = cv::v_setall_f32(static_cast<float>(start + i)) + four_steps;
      point.offer(sums, row, (sums < point.least) & (row >= cv::v_setall_f32(static_cast<float>(from))));
    }
    binned.add(start, gains);
  }
  const Four least = point.least == cv::v_setall_f32(cv::v_reduce_min(point.least));
  return static_cast<std::int32_t>(cv::v_reduce_min(cv::v_select(least, point.at, cv::v_setall_f32(kDepthHeight_px))));
}

bool SpanBoundaries::touch(std::int32_t column, std::int32_t bottom, std::int32_t top) noexcept {
  if (top - bottom <= params_.max_gap_px) return true;
  if (top - bottom > params_.max_strip_px) return false;
  work_.add(20 + 4 * (top - bottom));
  std::int32_t seen = 0;
  for (std::int32_t r = bottom + 1; r < top; ++r) seen += image_->by_column(r, column) > 0.0F ? 1 : 0;
  return seen < params_.max_gap_px;
}

void SpanBoundaries::score(std::int32_t column, bool by_planes) noexcept {
  Column& spans = columns_[static_cast<std::size_t>(column)];
  for (std::size_t k = 0; k < spans.size(); ++k) {
    ColumnSpan& upper = spans[k];
    work_.add(75);
    if (k == 0) extend(column, upper, -1, 0);
    if (k + 1 == spans.size()) {
      extend(column, upper, 1, rays_->height_px - 1);
      break;
    }
    ColumnSpan& lower = spans[k + 1];
    if (upper.plane == lower.plane || !touch(column, upper.bottom, lower.top)) {
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

void SpanBoundaries::place(Pair& pair) const noexcept {
  ChangePoint<double> point{0.0, 0.0, 0.0};  // in half bins from the first
  double meeting = 0.0;
  for (std::size_t half_bin = 0; half_bin < 2 * kBins; ++half_bin) {
    if (half_bin == kBins) meeting = point.sum;
    point.add(static_cast<double>(pair.gain[half_bin % 2][kRowsAtOnce + half_bin / 2]),
              static_cast<double>(half_bin + 1));
  }
  const double offset_px = 0.5 * point.at - 0.5 * kBins;
  const bool meets = std::abs(offset_px) < params_.meet_px || meeting - point.least < params_.meet_gain * pair.columns;
  pair.shift_px = meets ? 0.0 : offset_px;
}

bool SpanBoundaries::place_some() noexcept {
  constexpr std::size_t kPairsAtOnce = 8;
  constexpr std::int32_t kPairInstructions = 900;
  if (next_ >= pair_count_) return reproject_some();
  const std::size_t end = std::min(next_ + kPairsAtOnce, pair_count_);
  work_.add(end - next_, kPairInstructions);
  while (next_ < end) place(pairs_[next_++]);
  return next_ == pair_count_ && joint_count_ == 0;
}

void SpanBoundaries::reproject(const Joint& joint) noexcept {
  Column& spans = columns_[static_cast<std::size_t>(joint.column)];
  ColumnSpan &upper = spans[joint.upper], &lower = spans[joint.upper + 1U];
  const Line a = line_of(upper.plane, joint.column), b = line_of(lower.plane, joint.column);
  const double row = std::ceil(meeting_row(a, b) + pairs_[joint.pair].shift_px) - 1.0;
  if (!std::isfinite(row)) return;
  upper.bottom = static_cast<std::int16_t>(math::clamp(row, upper.top, lower.bottom - 1.0));
  lower.top = static_cast<std::int16_t>(upper.bottom + 1);
}

bool SpanBoundaries::reproject_some() noexcept {
  constexpr std::size_t kJointsAtOnce = 64;
  constexpr std::int32_t kJointInstructions = 85;
  const std::size_t first = next_ - pair_count_, end = std::min(first + kJointsAtOnce, joint_count_);
  work_.add(30);
  work_.add(end - first, kJointInstructions);
  for (std::size_t i = first; i < end; ++i) reproject(joints_[i]);
  next_ = pair_count_ + end;
  return end == joint_count_;
}

}  // namespace polygmap
