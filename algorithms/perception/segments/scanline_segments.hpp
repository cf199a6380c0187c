// SPDX-License-Identifier: Apache-2.0
// Cuts every column of the image into straight segments: on a plane, inverse depth is linear in the row. All columns
// advance together, row by row, so that the loop over them is vector code without branches.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"

namespace polygmap {

// The number of a plane in its frame, from 1 on. A byte: a picture has one for each of its columns' rows.
using PlaneId = std::uint8_t;
inline constexpr PlaneId kNoPlane = 0;

// Rows top .. bottom of one column; the line through them is inverse_depth + slope (row - top).
struct ScanlineSegment {
  std::int16_t top = 0;
  std::int16_t bottom = 0;
  float inverse_depth = 0.0F;  // 1/m, at top
  float slope = 0.0F;          // 1/m per row
  PlaneId plane = kNoPlane;    // that it was given to
  [[nodiscard]] std::int32_t rows() const noexcept { return bottom - top + 1; }
};

class ScanlineSegmentation {
 public:
  struct Params {
    double outlier_sigmas = 3.5;
    double bend_sigmas = 1.7;
    double jump_share = 0.03;
    double jump_sigmas = 4.0;
    double floor_m = 0.001;
    std::int32_t max_gap_px = 8;
    std::int32_t bend_rows = 7;

    static void visit(auto& p, auto& field) {
      field("outlier_sigmas", p.outlier_sigmas, 0.5, 20.0, "A row farther off a segment's line does not belong to it.");
      field("bend_sigmas", p.bend_sigmas, 0.1, 20.0,
            "A segment bends away where the mean residual of its last rows is larger.");
      field("jump_share", p.jump_share, 0.001, 0.5,
            "The first rows of a segment differ by less than this share of the depth per row.");
      field("jump_sigmas", p.jump_sigmas, 0.5, 20.0, "As many sigmas of the noise are added to that share.");
      field("floor_m", p.floor_m, 0.0, 0.1, "Slow depth errors, added to the noise.");
      field("max_gap_px", p.max_gap_px, 0, 200, "A segment may miss as many rows in a row.");
      field("bend_rows", p.bend_rows, 3, 480, "A segment of more rows may bend away.");
    }
  };
  static constexpr std::size_t kMaxSegmentsPerColumn = 48;
  using Column = StaticVector<ScanlineSegment, kMaxSegmentsPerColumn>;
  using Columns = std::array<Column, kColumns>;

  void begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
             const ColumnImage& image) noexcept;
  static constexpr std::int32_t kBlock = 4;  // rows that are best added together
  // Rows must come in order, 0 .. height - 1.
  void add_rows(std::int32_t first, std::int32_t last) noexcept;
  void finish() noexcept;

  [[nodiscard]] Columns& columns() noexcept { return segments_; }
  [[nodiscard]] const Columns& columns() const noexcept { return segments_; }
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }  // segments that found no room
  [[nodiscard]] WorkCount& work() noexcept { return work_; }                   // since it was last paid

 private:
  // No parameters: the step over a block of rows is compiled for these.
  static constexpr std::int32_t kPending = 3;  // outliers in a row that end a segment
  static constexpr std::int32_t kMinRows = 3;
  static constexpr float kMemory = 0.7F;     // of the mean of residuals, per row; kBentRows of them are left of it
  static constexpr std::int32_t kGroup = 8;  // columns that are decided on together, for every register width
  static_assert(kColumns % kGroup == 0);
  using Floats = std::array<float, kColumns>;

  // The state of all columns' open segments: the least-squares line through the accepted rows, updated row by row, so
  // that nothing large is ever subtracted and single precision is enough.
  struct Open {
    Floats rows;     // accepted, 0: no segment is open
    Floats value;    // of the line at the row last stepped, 1/m
    Floats slope;    // 1/m per row
    Floats lever;    // from the mean of the accepted rows to the row last stepped
    Floats squares;  // sum of squared rows from that mean
    Floats drift;    // recursive mean of residuals, 1/m
    Floats absent;   // rows since the last accepted one, an outlier counts outlier_weight_; whole numbers
  };

  struct Wides;  // the parameters in vector registers
  struct Block;
  struct OneColumn;
  [[nodiscard]] std::uint32_t try_blocks(const Wides& c, std::int32_t column, std::int32_t row) noexcept;
  [[nodiscard]] std::uint32_t add_row(const Wides& c, std::int32_t first_column, std::int32_t row) noexcept;
  void handle(std::int32_t g, std::int32_t row) noexcept;
  void replay(std::int32_t g, std::int32_t from, std::int32_t row) noexcept;
  void forget(std::int32_t g, std::int32_t from, std::int32_t row) noexcept;
  [[nodiscard]] std::int32_t last_accepted(std::int32_t g, std::int32_t row) const noexcept;
  void close(std::int32_t g, std::int32_t bottom, std::int32_t row) noexcept;
  void clear(std::int32_t g) noexcept;

  const ColumnImage* image_ = nullptr;
  std::int32_t column_count_ = 0;
  std::int32_t height_px_ = 0;
  float outlier2_ = 0.0F, bend2_ = 0.0F, bend_rows_ = 0.0F, max_gap_ = 0.0F, outlier_weight_ = 1.0F, fy_ = 1.0F,
        cy_ = 0.0F;
  float floor2_ = 0.0F;
  InverseSigma<float> sigma_{};  // of a column's inverse depth
  InverseSigma<float> jump_{};   // the most that a segment's first rows differ by from row to row: a polynomial like it
  Open open_;
  std::array<std::int16_t, kColumns> top_{};
  Columns segments_;
  std::uint32_t overflow_ = 0;
  WorkCount work_;
};

}  // namespace polygmap
