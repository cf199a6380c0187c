// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/remainder_search.hpp"

#include <algorithm>

namespace polygmap {

void RemainderSearch::begin(const Params& params, const Vec3& up) noexcept {
  params_ = params;
  level_.direction = up;
  level_.rows.fill(0);
  upright_.direction = Vec3::Zero();
  upright_.rows.fill(0);
  upright_pixels_ = 0.0;
  known_.clear();
  given_back_.fill(false);
  found_.clear();
}

void RemainderSearch::know_level(const InversePlane& plane) noexcept { static_cast<void>(known_.try_push_back(plane)); }

void RemainderSearch::know_upright(const InversePlane& plane, double pixels) noexcept {
  static_cast<void>(known_.try_push_back(plane));
  if (pixels <= upright_pixels_) return;
  const Vec3 normal = plane.normal(), flat = normal - level_.direction * level_.direction.dot(normal);
  if (!(flat.norm() > 0.5)) return;
  upright_pixels_ = pixels;
  upright_.direction = flat.normalized();
}

void RemainderSearch::add_column(const ColumnRays& rays, const ColumnImage& image, std::int32_t column,
                                 const SurfaceBoundaries::Column& spans) noexcept {
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
  const auto count = [](Axis& axis, float bin) {
    if (bin >= 0.0F && bin < static_cast<float>(Axis::kBins)) ++axis.rows[static_cast<std::size_t>(bin)];
  };
  const auto add_stretch = [&](std::int32_t first, std::int32_t last) {
    for (std::int32_t r = first; r <= last; ++r) {
      const float w = image.inverse_depth(column, r);
      if (!(w > 0.0F)) continue;
      const float y = rays.y[static_cast<std::size_t>(r)], z = 1.0F / w;
      count(level_, (level.at + level.slope * y) * z);
      count(upright_, (upright.at + upright.slope * y) * z);
    }
  };
  const auto add_rows = [&](std::int32_t first, std::int32_t last) {
    const std::int32_t until = std::min(last, first + kRemainderReach_px - 1);
    add_stretch(first, until);
    add_stretch(std::max(until + 1, last - kRemainderReach_px + 1), last);
  };
  std::int32_t next = 0;
  for (const ColumnSpan& span : spans) {
    if (given_back_[span.plane]) continue;
    add_rows(next, span.top - 1);
    next = span.bottom + 1;
  }
  add_rows(next, rays.height_px - 1);
}

void RemainderSearch::forget(Axis& axis, double distance_m, double apart_m) noexcept {
  const std::int32_t first = std::max(Axis::bin_of(distance_m - apart_m), 0);
  const std::int32_t last = std::min(Axis::bin_of(distance_m + apart_m), Axis::kBins - 1);
  for (std::int32_t b = first; b <= last; ++b) axis.rows[static_cast<std::size_t>(b)] = 0;
}

void RemainderSearch::find(Axis& axis) noexcept {
  constexpr std::int32_t kPeak = 1;     // bins to each side that belong to a peak
  constexpr std::int32_t kAround = 10;  // bins to each side that it is compared with
  for (int guard = 0; guard < 4; ++guard) {
    std::int32_t best = 0, at = -1;
    for (std::int32_t b = kAround; b < Axis::kBins - kAround; ++b) {
      std::int32_t rows = 0;
      for (std::int32_t i = b - kPeak; i <= b + kPeak; ++i) rows += axis.rows[static_cast<std::size_t>(i)];
      if (rows <= best) continue;
      best = rows;
      at = b;
    }
    if (best < params_.min_rows) return;
    std::int32_t around = 0;
    double sum = 0.0;
    for (std::int32_t i = at - kAround; i <= at + kAround; ++i) around += axis.rows[static_cast<std::size_t>(i)];
    for (std::int32_t i = at - kPeak; i <= at + kPeak; ++i) sum += axis.rows[static_cast<std::size_t>(i)] * (i + 0.5);
    const double distance_m = sum / best * Axis::kBin_m;
    // Per bin, peak against surroundings.
    const double peak = best / (2.0 * kPeak + 1.0), base = (around - best) / (2.0 * (kAround - kPeak));
    if (peak > params_.min_contrast * base && distance_m > params_.known_apart_m) {
      InversePlane plane;
      plane.m = -axis.direction / distance_m;
      if (!found_.try_push_back(plane)) return;
    }
    forget(axis, distance_m, 0.04);
  }
}

void RemainderSearch::finish() noexcept {
  // What lies near a known plane is that plane, seen past a leg or through a hole.
  constexpr double kParallel = 0.98;
  for (const InversePlane& known : known_) {
    for (Axis* axis : {&level_, &upright_}) {
      if (known.normal().dot(axis->direction) > kParallel) forget(*axis, known.d_m(), params_.known_apart_m);
    }
  }
  find(level_);
  if (upright_pixels_ > 0.0) find(upright_);
}

}  // namespace polygmap
