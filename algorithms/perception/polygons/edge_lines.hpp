// SPDX-License-Identifier: Apache-2.0
// Where a surface ends, to a fraction of a pixel: change-points in the columns of the picture, one line through all.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"

namespace polygmap {

class EdgeLineFinder {
 public:
  struct Params {
    std::int32_t window_px = 12;
    std::int32_t segment_px = 24;
    double truncate_sigmas = 3.0;
    std::int32_t min_side_px = 3;
    std::int32_t max_gap_px = 6;
    std::int32_t min_columns = 3;
    double min_length_m = 0.06;
    double max_rms_m = 0.006;
    double min_inlier_share = 0.5;
    // Where the two planes meet is the sharper answer when no overhang lies between: it uses every pixel of both. It is
    // taken when it lies within agree_m, or three sigmas of the change-points and one and a half of the planes, but
    // never beyond agree_max_m; far away, where a pixel is centimetres of the surface, within agree_px.
    double agree_m = 0.003;
    double agree_max_m = 0.008;
    double agree_px = 0.3;
    double face_m = 0.006;
    double face_max_m = 0.08;
    double slow_error_m = 0.0012;
    double least_local_m = 0.0004;

    static void visit(auto& p, auto& field) {
      field("window_px", p.window_px, 4, 16, "As many rows are searched to each side of the first guess.");
      field("segment_px", p.segment_px, 8, 640, "As many columns share one change-point.");
      field("truncate_sigmas", p.truncate_sigmas, 0.5, 20.0, "A pixel farther off its plane costs no more.");
      field("min_side_px", p.min_side_px, 1, 16,
            "As many rows of the window fit their plane on each side of the change-point.");
      field("max_gap_px", p.max_gap_px, 0, 100,
            "A column with more rows without data at the first guess says nothing.");
      field("min_columns", p.min_columns, 1, 80, "A line has as many columns of eight pixels.");
      field("min_length_m", p.min_length_m, 0.0, 1.0, "A line is as long.");
      field("max_rms_m", p.max_rms_m, 1e-4, 0.1, "Change-points lie no farther off their line.");
      field("min_inlier_share", p.min_inlier_share, 0.0, 1.0, "This share of the change-points lies on their line.");
      field("agree_m", p.agree_m, 0.0, 0.1,
            "The line where two planes meet is taken when it is no farther from the change-points, or within their "
            "sigmas.");
      field("agree_max_m", p.agree_max_m, 0.0, 0.2,
            "The line where two planes meet is never taken when it is farther from the change-points.");
      field("agree_px", p.agree_px, 0.0, 20.0,
            "Far away, where a pixel is centimetres of the surface, agreement is counted in pixels.");
      field("face_m", p.face_m, 0.0, 0.1, "An overhang's front face stands out from the riser by more.");
      field("face_max_m", p.face_max_m, 0.0, 0.5, "An overhang's front face stands out from the riser by less.");
      field.ordered("face_m", "face_max_m");
      field("slow_error_m", p.slow_error_m, 0.0, 0.1, "Error of a segment's change-point that its columns share.");
      field("least_local_m", p.least_local_m, 0.0, 0.1,
            "Error of where the planes meet locally, however well its columns agree.");
    }
  };
  enum class Outcome : std::uint8_t { kFound, kAgain, kFewColumns, kNoLine, kNotStraight, kShort };

  // The surface's last row in a column, as a first guess.
  void begin_guess() noexcept { guess_count_ = 0; }
  void add_guess(std::int32_t column, std::int32_t row) noexcept;
  // A line through most of the guesses; false when there is none.
  [[nodiscard]] bool try_guess(const Params& params, std::uint32_t seed) noexcept;

  struct Measured {
    InversePlane plane;
    Mat3 covariance = Mat3::Zero();  // of its m
  };
  // surface_above: the surface lies above its boundary in the picture (a nosing), else below it (a back line). other:
  // the plane on the far side; null when that is not known, then only leaving the surface's plane counts.
  void begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
             const ColumnRays& rays, const ColumnImage& image, const Measured& own, const Measured* other,
             bool surface_above) noexcept;
  // Searches the next columns; true when all are done. At most max_columns columns, a multiple of kLanes.
  bool step(std::int32_t max_columns) noexcept;
  // kAgain: the tread overhangs the riser with a face of its own; step() once more, against that face.
  [[nodiscard]] Outcome finish(EdgeLine& line) noexcept;
  // The first guess on the surface's plane, after begin(); good to a pixel.
  [[nodiscard]] EdgeLine guessed_line() const noexcept { return {guess_a_m_, guess_b_m_, 0.01, true}; }

  [[nodiscard]] std::int32_t column_count() const noexcept { return count_; }

 private:
  struct Guess {
    std::int16_t column, row;
  };
  static constexpr std::int32_t kLanes = 8;  // columns that are searched together, on every machine
  static constexpr std::int32_t kMaxWindow_px = 16;
  static constexpr std::int32_t kOffsets = 2 * kMaxWindow_px + 1;
  static constexpr std::int32_t kMaxSegments = 24;
  using Lanes = std::array<float, kLanes>;

  // Columns are pooled in segments: one column's change-point is skewed towards the less noisy plane by up to a pixel,
  // the pooled one is not.
  struct Segment {
    std::array<float, kOffsets> gain{};  // sum of cost(surface) - cost(other), by rows from the guess, outwards
    double columns = 0.0;
    double column_sum = 0.0;   // of their middles, pixels
    double rounded_sum = 0.0;  // of the guess less the row that it was rounded to
  };
  [[nodiscard]] double guess_at(double column_px) const noexcept { return guess_row_ + guess_slope_ * column_px; }
  [[nodiscard]] static double middle_px(std::int32_t column) noexcept {
    return kColumn_px * column + 0.5 * (kColumn_px - 1);
  }
  // kLanes columns from a multiple of kLanes on.
  void search_columns(std::int32_t first_column) noexcept;
  void take_column(std::int32_t column, std::int32_t centre, std::int32_t first_row, std::int32_t last_row,
                   std::size_t lane) noexcept;
  void restart() noexcept;
  void add_face(std::int32_t column, std::int32_t from_row, std::int32_t last_row) noexcept;
  // How far the first pixels past the change-point stand out from the other plane; false when there are too few.
  [[nodiscard]] bool try_face_offset(double& offset_m) const noexcept;
  [[nodiscard]] double pixel_m(double along_m, double across_m) const noexcept;
  // Where across the surface the picture's row is that many below the one of (along, across).
  [[nodiscard]] double below_m(double along_m, double across_m, double rows) const noexcept;
  // By how many rows the planes meet below where they meet as a whole, as the few rows on both sides say: what a slow
  // error of the camera adds to both planes' pixels at the edge does not move it there, but each plane's fit. Nosings
  // only: it takes .25 % of a frame's instructions.
  struct Shift {
    double start_px = 0.0, at_px = 0.0, per_column = 0.0;  // at_px at start_px
    double sigma_px = 0.0;                                 // at the line's ends
    [[nodiscard]] double at(double column_px) const noexcept {
      return at_px + per_column * (column_px - start_px) / kColumn_px;
    }
  };
  [[nodiscard]] bool try_local_shift(Shift& shift) const noexcept;
  [[nodiscard]] bool try_segment_point(const Segment& segment, Vec2& point_m) const noexcept;

  std::array<Guess, kColumns> guess_{};
  std::size_t guess_count_ = 0;
  double guess_row_ = 0.0;  // row of the guessed line at pixel column 0
  double guess_slope_ = 0.0;
  std::int32_t first_column_ = 0;
  std::int32_t last_column_ = -1;

  Params params_;
  DepthNoiseModel noise_;
  CameraIntrinsics intrinsics_;
  const ColumnRays* rays_ = nullptr;
  const ColumnImage* image_ = nullptr;
  InversePlane surface_;
  InversePlane other_;
  Mat3 other_covariance_ = Mat3::Zero();
  Mat3 both_covariance_ = Mat3::Zero();  // of the difference of both planes' m
  bool other_known_ = false;
  bool surface_above_ = true;
  std::int32_t next_column_ = 0;

  // Coordinates (along, across) on the surface's plane.
  Vec3 origin_m_ = Vec3::Zero();
  Vec3 guess_a_m_ = Vec3::Zero();
  Vec3 guess_b_m_ = Vec3::Zero();
  Vec3 along_ = Vec3::UnitX();
  Vec3 across_ = Vec3::UnitY();

  std::array<Lanes, kDepthHeight_px> gains_{};  // of the columns searched together, by row
  std::array<Segment, kMaxSegments> segments_{};
  std::int32_t segment_count_ = 0;
  static constexpr std::int32_t kFaceBins = 64;
  static constexpr double kFaceBin_m = 0.002;
  std::array<std::int32_t, kFaceBins> face_{};  // offsets of 0, 2, ... mm; below 0 counts as 0
  bool face_tried_ = false;
  std::array<Vec2, kMaxSegments> points_m_{};
  std::array<double, kMaxSegments> weights_{};
  std::array<double, kMaxSegments> scratch_{};
  std::int32_t count_ = 0;
};

}  // namespace polygmap
