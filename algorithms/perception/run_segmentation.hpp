// SPDX-License-Identifier: Apache-2.0
// Cuts every column of the picture into straight runs: on a plane, inverse depth is linear in the row. All columns
// advance together, row by row, so that the loop over them is vector code without branches.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/static_vector.hpp"
#include "algorithms/perception/column_image.hpp"

namespace polygmap {

// Rows top .. bottom of one column; the line through them is inverse_depth + slope (row - top).
struct Run {
  std::int16_t top = 0;
  std::int16_t bottom = 0;
  float inverse_depth = 0.0F;  // 1/m, at top
  float slope = 0.0F;          // 1/m per row
  std::uint8_t plane = 0;      // that it was given to, 0 = none
  [[nodiscard]] std::int32_t rows() const noexcept { return bottom - top + 1; }
};

class RunSegmentation {
 public:
  struct Params {
    double outlier_sigmas = 3.5;  // a row this far off the run's line does not belong to it
    double bend_sigmas = 1.7;     // mean of the last rows' residuals: the run bends away
    double jump_share = 0.03;     // the first rows of a run differ by less than this share of the depth per row
    double floor_m = 0.001;       // slow depth errors, added to the noise
    std::int32_t max_gap_px = 8;  // rows without data inside a run
  };
  static constexpr std::size_t kMaxRunsPerColumn = 48;
  using Column = StaticVector<Run, kMaxRunsPerColumn>;
  using Columns = std::array<Column, kColumns>;

  void begin(const Params& params, const DepthSigma& noise, const CameraIntrinsics& intrinsics,
             const ColumnImage& image) noexcept;
  // Rows must come in order, 0 .. height - 1.
  void add_row(std::int32_t row) noexcept;
  void finish() noexcept;

  [[nodiscard]] Columns& columns() noexcept { return runs_; }
  [[nodiscard]] const Columns& columns() const noexcept { return runs_; }
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }  // runs that found no room

 private:
  static constexpr float kPending = 3.0F;  // outliers in a row that end a run
  static constexpr std::int32_t kMinRows = 3;
  static constexpr float kMemory = 0.7F;  // of the mean of residuals, per row

  // Events, as floats: one vector width for all. No two at once.
  static constexpr float kNone = 0.0F, kOut = 1.0F, kBend = 2.0F, kGap = 3.0F;
  using Floats = std::array<float, kColumns>;

  // The state of all columns' open runs. Sums over accepted rows, t counted from the run's top and inverse depth from
  // the first row's, so that single precision is enough.
  struct Open {
    Floats n, t, tt, w, tw;                    // sums
    Floats first, a, b;                        // inverse depth at top; line first + a + b t
    Floats mean;                               // recursive mean of normalised residuals
    Floats top, last, pending, pending_first;  // rows, as floats: one vector width for all
  };

  void handle(std::int32_t g, std::int32_t row) noexcept;
  void close(std::int32_t g, std::int32_t bottom) noexcept;
  void clear(std::int32_t g) noexcept;
  template <typename Lanes>
  void step(std::int32_t column, float row, const float* inverse_depth) noexcept;

  const ColumnImage* image_ = nullptr;
  std::int32_t column_count_ = 0;
  std::int32_t height_px_ = 0;
  float outlier2_ = 0.0F, bend_ = 0.0F, jump_share_ = 0.0F, base_ = 0.0F, per_metre_ = 0.0F, quadratic_ = 0.0F,
        floor_ = 0.0F;
  float max_gap_ = 0.0F, fy_ = 1.0F, cy_ = 0.0F;
  Open open_;
  Floats event_{};
  Columns runs_;
  std::uint32_t overflow_ = 0;
};

}  // namespace polygmap
