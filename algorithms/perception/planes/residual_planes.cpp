// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/residual_planes.hpp"

#include <algorithm>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {

void ResidualPlaneSearch::begin(const Params& params, const Vec3& up) noexcept {
  params_ = params;
  level_.direction = up;
  level_.rows.fill(0);
  upright_.direction = Vec3::Zero();
  upright_.rows.fill(0);
  upright_pixels_ = 0.0;
  known_.clear();
  released_.fill(false);
  found_.clear();
}

void ResidualPlaneSearch::add_known_level(const InversePlane& plane) noexcept {
  static_cast<void>(known_.try_push_back(plane));
}

void ResidualPlaneSearch::add_known_riser(const InversePlane& plane, double pixels) noexcept {
  static_cast<void>(known_.try_push_back(plane));
  if (pixels <= upright_pixels_) return;
  const Vec3 normal = plane.normal(), flat = normal - level_.direction * level_.direction.dot(normal);
  if (!(flat.norm() > 0.5)) return;
  upright_pixels_ = pixels;
  upright_.direction = flat.normalized();
}

void ResidualPlaneSearch::add_column(const ColumnRays& rays, const ColumnImage& image, std::int32_t column,
                                     const SpanBoundaries::Column& spans) noexcept {
  // Of a ray in this column: its steps along an axis are bins times inverse depth, linear in the row.
  struct Steps {
    float at, slope;
    Steps(const Axis& axis, float x) noexcept
        // A plane that faces the camera lies on the far side of its normal.
        : at(static_cast<float>(-(axis.direction.x() * static_cast<double>(x) + axis.direction.z()) / Axis::kBin_m)),
          slope(static_cast<float>(-axis.direction.y() / Axis::kBin_m)) {}
  };
  const float x = rays.x[static_cast<std::size_t>(column)];
  const Steps level(level_, x), upright(upright_, x);
  using Wide = cv::v_float32;
  constexpr std::int32_t kAtOnce = 8;  // rows, for every register width
  static_assert(kAtOnce % Wide::nlanes == 0 && kDepthHeight_px % kAtOnce == 0);
  const auto all = [](float value) { return cv::vx_setall_f32(value); };
  const Wide zero = all(0.0F), end = all(static_cast<float>(Axis::kBins)), none = end;
  const float *ws = image.by_column.row(column), *ys = rays.y.data();
  std::int32_t times = 0;
  const auto add_stretch = [&](std::int32_t first, std::int32_t last) {
    for (std::int32_t from = first; from <= last; from += kAtOnce, ++times) {
      const std::int32_t start = std::min(from, kDepthHeight_px - kAtOnce), until = std::min(last + 1 - start, kAtOnce);
      std::array<std::int32_t, kAtOnce> level_bins, upright_bins;
      for (std::int32_t i = 0; i < kAtOnce; i += Wide::nlanes) {
        const Wide w = cv::vx_load(ws + start + i), y = cv::vx_load(ys + start + i);
        const Wide z = all(1.0F) / w;
        const auto bins = [&](const Steps& steps) {
          const Wide bin = (all(steps.at) + all(steps.slope) * y) * z;
          return cv::v_trunc(cv::v_select((w > zero) & (bin >= zero) & (bin < end), bin, none));
        };
        cv::v_store(level_bins.data() + i, bins(level));
        cv::v_store(upright_bins.data() + i, bins(upright));
      }
      for (std::int32_t i = from - start; i < until; ++i) {
        ++level_.rows[static_cast<std::size_t>(level_bins[static_cast<std::size_t>(i)])];
        ++upright_.rows[static_cast<std::size_t>(upright_bins[static_cast<std::size_t>(i)])];
      }
    }
  };
  const auto add_rows = [&](std::int32_t first, std::int32_t last) {
    const std::int32_t until = std::min(last, first + kRemainderReach_px - 1);
    add_stretch(first, until);
    add_stretch(std::max(until + 1, last - kRemainderReach_px + 1), last);
  };
  std::int32_t next = 0;
  for (const ColumnSpan& span : spans) {
    if (released_[span.plane]) continue;
    add_rows(next, span.top - 1);
    next = span.bottom + 1;
  }
  add_rows(next, rays.height_px - 1);
  work_.add(130 + 54 * static_cast<std::int32_t>(spans.size()) + 175 * times);
}

void ResidualPlaneSearch::forget(Axis& axis, double distance_m, double apart_m) noexcept {
  const std::int32_t first = std::max(Axis::bin_of(distance_m - apart_m), 0);
  const std::int32_t last = std::min(Axis::bin_of(distance_m + apart_m), Axis::kBins - 1);
  for (std::int32_t b = first; b <= last; ++b) axis.rows[static_cast<std::size_t>(b)] = 0;
}

void ResidualPlaneSearch::find(Axis& axis) noexcept {
  constexpr std::int32_t kPeak = 1;  // bins to each side that belong to a peak, see peak_at
  const std::int32_t around_bins = params_.around_bins, first = around_bins, end = Axis::kBins - around_bins;
  for (int guard = 0; guard < 4; ++guard) {
    work_.add(Axis::kBins, 4);
    // The largest peak, the first of those.
    using Wide = cv::v_int32;
    const auto load = [&axis](std::int32_t b) { return cv::vx_load(axis.rows.data() + b); };
    const std::int32_t whole = first + (end - first) / Wide::nlanes * Wide::nlanes;
    const auto peak_at = [&axis](std::int32_t b) {
      const std::int32_t* rows = axis.rows.data() + b;
      return rows[-1] + rows[0] + rows[1];
    };
    Wide most = cv::vx_setzero_s32();
    for (std::int32_t b = first; b < whole; b += Wide::nlanes) {
      most = cv::v_max(most, load(b - 1) + load(b) + load(b + 1));
    }
    std::int32_t best = cv::v_reduce_max(most), at = first;
    for (std::int32_t b = whole; b < end; ++b) best = std::max(best, peak_at(b));
    if (best < std::max(params_.min_rows, 1)) return;
    while (peak_at(at) != best) ++at;
    std::int32_t around = 0;
    double sum = 0.0;
    for (std::int32_t i = at - around_bins; i <= at + around_bins; ++i)
      around += axis.rows[static_cast<std::size_t>(i)];
    for (std::int32_t i = at - kPeak; i <= at + kPeak; ++i) sum += axis.rows[static_cast<std::size_t>(i)] * (i + 0.5);
    const double distance_m = sum / best * Axis::kBin_m;
    // Per bin, peak against surroundings.
    const double peak = best / (2.0 * kPeak + 1.0), base = (around - best) / (2.0 * (around_bins - kPeak));
    if (peak > params_.min_contrast * base && distance_m > params_.known_apart_m) {
      InversePlane plane;
      plane.m = -axis.direction / distance_m;
      if (!found_.try_push_back(plane)) return;
    }
    forget(axis, distance_m, params_.peaks_apart_m);
  }
}

void ResidualPlaneSearch::finish() noexcept {
  work_.add(known_.size(), 160);
  // What lies near a known plane is that plane, seen past a leg or through a hole.
  for (const InversePlane& known : known_) {
    for (Axis* axis : {&level_, &upright_}) {
      if (known.normal().dot(axis->direction) > params_.known_parallel_cos)
        forget(*axis, known.d_m(), params_.known_apart_m);
    }
  }
  find(level_);
  if (upright_pixels_ > 0.0) find(upright_);
}

}  // namespace polygmap
