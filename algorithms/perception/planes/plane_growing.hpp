// SPDX-License-Identifier: Apache-2.0
// Gathers straight segments of neighbouring columns into planes: longest segments first, breadth first, each plane
// refitted as it grows. Resumable.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/segments/scanline_segments.hpp"

namespace polygmap {

struct GrownPlane {
  InversePlane plane;
  PlaneMoments moments;  // of its segments' pixels
};

class PlaneGrowing {
 public:
  struct Params {
    double join_sigmas = 1.5;
    double join_floor_m = 0.003;
    std::int32_t min_rows = 3;
    std::int32_t min_columns = 3;
    std::int32_t min_plane_px = 800;
    std::int32_t min_facet_px = 400;
    double refit_growth = 1.3;

    static void visit(auto& p, auto& field) {
      field(
          "join_sigmas", p.join_sigmas, 0.1, 20.0,
          "A segment belongs to a plane when its line is no more than join_floor_m and as many sigmas of the depth off "
          "it.");
      field("join_floor_m", p.join_floor_m, 0.0, 0.1,
            "Slow depth errors, which a segment may be off a plane besides join_sigmas.");
      field("min_rows", p.min_rows, 2, 100, "A segment that starts a plane has as many rows.");
      field("min_columns", p.min_columns, 1, 40, "A plane has as many columns.");
      field("min_plane_px", p.min_plane_px, 1, 100000,
            "A plane that is to be one by itself has as many pixels of full resolution.");
      field("min_facet_px", p.min_facet_px, 1, 100000,
            "A plane that may be part of another has as many pixels of full resolution.");
      field("refit_growth", p.refit_growth, 1.01, 10.0, "A plane is refitted when it has grown by this factor.");
    }
  };
  static constexpr std::size_t kMaxPlanes = 96;

  void begin(const Params& params, const DepthNoiseModel& noise, const ColumnRays& rays,
             ScanlineSegmentation::Columns& segments) noexcept;
  // A bounded piece of work; true when all is done. Then every segment knows its plane, 1-based.
  [[nodiscard]] bool step() noexcept;
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] const GrownPlane& plane(std::size_t i) const noexcept { return planes_[i]; }  // 1-based
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }

 private:
  static constexpr std::size_t kQueue =
      static_cast<std::size_t>(kColumns) * ScanlineSegmentation::kMaxSegmentsPerColumn;
  static constexpr std::uint8_t kTried = 255;  // a segment that grew into nothing

  struct Place {
    std::int16_t column = 0;
    std::int16_t index = 0;
  };
  struct Queue {
    std::array<Place, kQueue> places{};
    std::size_t size = 0;
    std::size_t next = 0;
  };
  // Over the pixels of segments.
  struct Sums {
    PlaneMoments m;   // each pixel weighs 1
    double ww = 0.0;  // of squared inverse depths
    void add(double ray_x, const ColumnRays& rays, const ScanlineSegment& segment) noexcept;
    [[nodiscard]] bool try_solve(Vec3& plane) const noexcept;
    [[nodiscard]] double mean_square(const Vec3& plane) const noexcept;  // residual of inverse depth
  };

  [[nodiscard]] ScanlineSegment& at(Place p) noexcept {
    return (*segments_)[static_cast<std::size_t>(p.column)][static_cast<std::size_t>(p.index)];
  }
  // Columns that are gone through in one piece: before planes grow, and afterwards.
  static constexpr std::int32_t kColumnsAtOnce = 16;
  enum class Part : std::uint8_t { kCount, kSort, kGrow, kClear };
  void count_column(std::int32_t column) noexcept;
  void sort_seeds(std::int32_t column) noexcept;
  void clear_tried(std::int32_t column) noexcept;
  void begin_sorting() noexcept;
  // Of kColumnsAtOnce columns; true after the last.
  [[nodiscard]] bool prepare_some() noexcept;
  void grow_some() noexcept;
  // Of the first segment of a column that ends at this row or below, or of one a little above it.
  [[nodiscard]] std::size_t first_near(std::int32_t column, std::int32_t row) const noexcept {
    return first_near_[static_cast<std::size_t>(column)][static_cast<std::size_t>(row / kIndexRows)];
  }
  [[nodiscard]] bool try_seed(Place place) noexcept;
  [[nodiscard]] bool try_neighbour(Place from, std::int32_t side, Place& best) noexcept;
  void visit(Place place) noexcept;
  void consider(Place place) noexcept;
  void close() noexcept;
  // The tolerance of a distance times inverse depth.
  [[nodiscard]] double tolerance_w(double w) const noexcept {
    return params_.join_floor_m * w + params_.join_sigmas * noise_.inverse_sigma(w) / w;
  }

  Params params_;
  DepthNoiseModel noise_;
  const ColumnRays* rays_ = nullptr;
  ScanlineSegmentation::Columns* segments_ = nullptr;

  static constexpr std::int32_t kIndexRows = 16;
  std::array<std::array<std::uint8_t, kDepthHeight_px / kIndexRows + 1>, kColumns> first_near_{};
  Queue seeds_;

  Queue queue_;  // of the plane that grows: all its segments, those before next visited
  struct {
    Part part = Part::kCount;
    std::int32_t column = 0;                                 // the next one to be gone through
    std::array<std::uint16_t, kDepthHeight_px + 2> start{};  // of the seeds of a length, longest first
  } pass_;
  WorkCount work_;
  bool growing_ = false;
  Sums sums_;
  Vec3 m_ = Vec3::UnitZ();
  double norm2_ = 1.0;  // of m_
  double next_fit_px_ = 0.0;
  std::int32_t first_column_ = 0;
  std::int32_t last_column_ = 0;

  std::array<GrownPlane, kMaxPlanes + 1> planes_{};
  std::size_t count_ = 0;
  std::uint32_t overflow_ = 0;
};

}  // namespace polygmap
