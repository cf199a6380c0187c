// SPDX-License-Identifier: Apache-2.0
// Level and upright planes in what the grown planes left over.
//
// A far tread cut off by the picture's upper end is a few rows high: its segments are too short to say how it lies. But
// gravity does, and which way the other risers face: all its pixels have one height, or one distance from the riser
// before. Histograms of both over all rows that belong to no plane find it.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {

class ResidualPlaneSearch {
 public:
  struct Params {
    std::int32_t min_rows = 50;
    double min_contrast = 2.5;
    double known_apart_m = 0.015;
    double known_parallel_cos = 0.98;
    double peaks_apart_m = 0.04;
    std::int32_t around_bins = 10;

    static void visit(auto& p, auto& field) {
      field("min_rows", p.min_rows, 1, 10000, "A peak has as many column rows of eight pixels.");
      field("min_contrast", p.min_contrast, 1.0, 100.0, "A peak stands out this many times from what lies around it.");
      field("known_apart_m", p.known_apart_m, 0.0, 0.2, "A peak nearer to a known plane is that plane.");
      field("known_parallel_cos", p.known_parallel_cos, 0.5, 1.0,
            "A known plane whose turn against the axis has a larger cosine has a place along it.");
      field("peaks_apart_m", p.peaks_apart_m, 0.0, 0.5, "A peak nearer to one that was looked at is not looked at.");
      field("around_bins", p.around_bins, 2, 20,
            "A peak is compared with as many bins of 5 mm to each side of its middle.");
    }
  };
  static constexpr std::size_t kMaxFound = 8;

  void begin(const Params& params, const Vec3& up) noexcept;
  // Planes that are known already. The largest upright one says which way risers face.
  void add_known_level(const InversePlane& plane) noexcept;
  void add_known_riser(const InversePlane& plane, double pixels) noexcept;
  // The spans of a plane that was given up are searched as if their rows were in none.
  void release(std::size_t plane) noexcept { released_[plane] = true; }
  // Adds the rows of a column that are in none of its spans.
  void add_column(const ColumnRays& rays, const ColumnImage& image, std::int32_t column,
                  const SpanBoundaries::Column& spans) noexcept;
  void finish() noexcept;

  [[nodiscard]] const StaticVector<InversePlane, kMaxFound>& found() const noexcept { return found_; }

  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  // Rows by their distance from the camera along an axis.
  struct Axis {
    static constexpr std::int32_t kBins = 1024;
    static constexpr double kBin_m = 0.005;
    Vec3 direction = Vec3::Zero();               // unit, the planes' normal; zero: not in use
    std::array<std::int32_t, kBins + 1> rows{};  // the last: in none
    [[nodiscard]] static std::int32_t bin_of(double distance_m) noexcept {
      return static_cast<std::int32_t>(std::floor(distance_m / kBin_m));
    }
  };
  void find(Axis& axis) noexcept;
  static void forget(Axis& axis, double distance_m, double apart_m) noexcept;

  Params params_;
  Axis level_;
  Axis upright_;
  double upright_pixels_ = 0.0;
  std::array<bool, SpanBoundaries::kMaxPlanes + 1> released_{};
  StaticVector<InversePlane, SpanBoundaries::kMaxPlanes> known_;
  StaticVector<InversePlane, kMaxFound> found_;
  WorkCount work_;
};

}  // namespace polygmap
