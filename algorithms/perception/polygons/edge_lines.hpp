// SPDX-License-Identifier: Apache-2.0
// Where a surface ends, to a fraction of a pixel: change-points in the columns of the image, one line through all.
//
// Where rows without depth lie between the two surfaces (a dark or shiny strip along a nosing), a change-point is
// anywhere among them: its middle is taken, and its reach to both sides is kept with it. The plane beyond says more
// when its first rows lie where it meets the surface's plane; then that is the edge, and the rows were the surface's.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"

namespace polygmap {

class EdgeLineFinder {
 public:
  // A line through most of the surface's last rows.
  struct GuessParams {
    std::int32_t trials = 32;
    double tolerance_px = 5.0;
    double enough = 0.9;

    static void visit(auto& p, auto& field) {
      field("trials", p.trials, 1, 32, "As many lines through two of the last rows are tried.");
      field("tolerance_px", p.tolerance_px, 0.5, 50.0, "A last row that is nearer lies on such a line.");
      field("enough", p.enough, 0.1, 1.0, "A line that holds for this share of the last rows ends the search.");
    }
  };
  // By how much two planes meet elsewhere than their fits say, as the rows near the edge have it.
  struct ShiftParams {
    double from_px = 0.5, to_px = 4.5;
    double min_rows = 1.5;
    double max_px = 3.0;

    static void visit(auto& p, auto& field) {
      field("from_px", p.from_px, 0.0, 5.0, "Rows that tell the shift are farther from where the planes meet.");
      field("to_px", p.to_px, 1.0, 16.0, "Rows that tell the shift are nearer to where the planes meet.");
      field.ordered("from_px", "to_px");
      field("min_rows", p.min_rows, 0.5, 16.0, "A column that tells the shift has more such rows on each plane.");
      field("max_px", p.max_px, 0.1, 50.0, "A column that tells a larger shift does not count.");
    }
  };
  // When the line where two planes meet and the change-points are one edge.
  struct AgreeParams {
    // Where the two planes meet is the sharper answer when no overhang lies between: it uses every pixel of both. It is
    // taken when it lies within least_m, or within_sigmas of both, but never beyond most_m; far away, where a pixel is
    // centimetres of the surface, within_px of it.
    double least_m = 0.003;
    double most_m = 0.008;
    double within_px = 0.3;
    double within_sigmas = 1.5;

    static void visit(auto& p, auto& field) {
      field("least_m", p.least_m, 0.0, 0.1,
            "The line where two planes meet is taken when it is no farther from the change-points, or within their "
            "sigmas.");
      field("most_m", p.most_m, 0.0, 0.2,
            "The line where two planes meet is never taken when it is farther from the change-points.");
      field("within_px", p.within_px, 0.0, 20.0,
            "Far away, where a pixel is centimetres of the surface, agreement is counted in pixels.");
      field("within_sigmas", p.within_sigmas, 0.1, 10.0,
            "Agreement within as many sigmas of both, between least_m and most_m.");
    }
  };
  // An overhang's front face.
  struct FaceParams {
    double min_m = 0.006;
    double max_m = 0.08;
    std::int32_t rows = 4;  // a face 30 mm high is 7 pixels high at 0.8 m
    std::int32_t before_px = 6;

    static void visit(auto& p, auto& field) {
      field("min_m", p.min_m, 0.0, 0.1, "An overhang's front face stands out from the riser by more.");
      field("max_m", p.max_m, 0.0, 0.5, "An overhang's front face stands out from the riser by less.");
      field.ordered("min_m", "max_m");
      field("rows", p.rows, 1, 64, "As many rows of a column tell how far an overhang's face stands out.");
      field("before_px", p.before_px, 0, 16,
            "The rows of an overhang's face are looked for from as far before the change-point.");
    }
  };
  struct Params {
    std::int32_t window_px = 12;
    std::int32_t group_px = 24;
    double truncate_sigmas = 3.0;
    std::int32_t min_side_px = 3;
    std::int32_t max_gap_px = 6;
    std::int32_t min_columns = 3;
    double min_length_m = 0.06;
    double max_rms_m = 0.006;
    double min_inlier_share = 0.5;
    double slow_error_m = 0.0012;
    double least_local_m = 0.0004;
    double least_scale_m = 0.0008;
    double seen_variance_gain = 2.0;
    double shared = 0.3;
    GuessParams guess;
    ShiftParams shift;
    AgreeParams agree;
    FaceParams face;

    static void visit(auto& p, auto& field) {
      field("window_px", p.window_px, 4, 16, "As many rows are searched to each side of the first guess.");
      field("group_px", p.group_px, 8, 640, "As many columns share one change-point.");
      field("truncate_sigmas", p.truncate_sigmas, 0.5, 20.0, "A pixel farther off its plane costs no more.");
      field("min_side_px", p.min_side_px, 1, 16,
            "As many rows of the window fit their plane on each side of the change-point.");
      field("max_gap_px", p.max_gap_px, 0, 100,
            "A column with more rows without data at the first guess says nothing.");
      field("min_columns", p.min_columns, 1, 80, "A line has as many columns of eight pixels.");
      field("min_length_m", p.min_length_m, 0.0, 1.0, "A line is as long.");
      field("max_rms_m", p.max_rms_m, 1e-4, 0.1, "Change-points lie no farther off their line.");
      field("min_inlier_share", p.min_inlier_share, 0.0, 1.0, "This share of the change-points lies on their line.");
      field("slow_error_m", p.slow_error_m, 0.0, 0.1,
            "Error of the change-point of group_px columns that its columns share.");
      field("least_local_m", p.least_local_m, 0.0, 0.1,
            "Error of where the planes meet locally, however well its columns agree.");
      field("least_scale_m", p.least_scale_m, 1e-5, 0.1,
            "The scatter of the change-points is taken for no less when outliers are told from them.");
      field(
          "seen_variance_gain", p.seen_variance_gain, 1.0, 100.0,
          "The variance of the line through the change-points is this many times what their scatter says, which hides "
          "that they are skewed towards the less noisy plane.");
      field("shared", p.shared, 0.0, 1.0,
            "The change-points, the planes' meeting and the local shift share this part of their errors.");
      field("guess", p.guess);
      field("shift", p.shift);
      field("agree", p.agree);
      field("face", p.face);
    }
  };
  enum class Outcome : std::uint8_t { kFound, kAgain, kFewColumns, kNoLine, kNotStraight, kShort };

  // The surface's last row in a column, as a first guess.
  void begin_guess() noexcept { guesses_.clear(); }
  void add_guess(std::int32_t column, std::int32_t row) noexcept;
  // A line through most of the guesses; false when there is none.
  [[nodiscard]] bool try_guess(const Params& params, std::uint32_t seed) noexcept;

  struct Measured {
    InversePlane plane;
    Mat3 covariance = Mat3::Zero();  // of its m
  };
  enum class Kind : std::uint8_t {
    kNosing,  // the surface lies above its boundary in the image
    kBack,    // ... below it
    kLip      // likewise, and what is beyond lies lower: its beginning is hidden
  };
  // other: the plane on the far side; null when that is not known, then only leaving the surface's plane counts.
  void begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
             const ColumnRays& rays, const ColumnImage& image, const Measured& own, const Measured* other,
             Kind kind) noexcept;
  // Searches the next columns; true when all are done. At most max_columns columns, a multiple of kSlots.
  bool step(std::int32_t max_columns) noexcept;
  // kAgain: the tread overhangs the riser with a face of its own; step() once more, against that face.
  [[nodiscard]] Outcome finish(EdgeLine& line) noexcept;
  // The first guess on the surface's plane, after begin(); good to a pixel.
  [[nodiscard]] EdgeLine guessed_line() const noexcept { return {guess_ends_m_[0], guess_ends_m_[1], 0.01, true}; }

  [[nodiscard]] std::int32_t column_count() const noexcept { return groups_.columns; }
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  static constexpr std::int32_t kSlots = 8;          // columns that are searched together, on every machine
  static constexpr std::int32_t kMaxWindow_px = 24;  // the one that is moved onto a gap
  static constexpr std::int32_t kOffsets = 2 * kMaxWindow_px + 1;
  static constexpr std::int32_t kMaxGroups = 24;
  using Slots = std::array<float, kSlots>;

  struct Guess {
    std::int16_t column, row;
  };
  struct GuessLine {
    double row = 0.0;  // at pixel column 0
    double slope = 0.0;
    std::int32_t first_column = 0, last_column = -1;
    [[nodiscard]] double at(double column_px) const noexcept { return row + slope * column_px; }
  };
  struct OtherPlane {
    bool known = false;
    InversePlane plane;
    Mat3 covariance = Mat3::Zero();       // of its m
    Mat3 both_covariance = Mat3::Zero();  // of the difference of both planes' m
  };
  // Coordinates (along, across) on the surface's plane.
  struct Axes {
    Vec3 origin_m = Vec3::Zero();
    Vec3 along = Vec3::UnitX();
    Vec3 across = Vec3::UnitY();
    [[nodiscard]] Vec3 point(double along_m, double across_m) const noexcept {
      return origin_m + along_m * along + across_m * across;
    }
  };
  // Columns next to each other: one column's change-point is skewed towards the less noisy plane by up to a pixel, that
  // of all their gains is not.
  struct Group {
    std::array<float, kOffsets> gain{};  // sum of cost(surface) - cost(other), by rows from the guess, outwards
    double columns = 0.0;
    double column_sum = 0.0;   // of their middles, pixels
    double rounded_sum = 0.0;  // of the guess less the row that it was rounded to
    float seen_rows = 0.0F;    // near the guess, with data, of all its columns
  };
  struct Groups {
    std::array<Group, kMaxGroups> of{};
    std::int32_t count = 0;
    std::int32_t columns = 0;  // in all of them
    std::int32_t refused = 0;  // columns that are in none of them
  };
  // Rows without data on which an edge lies: from between two rows to between two rows, counted outwards in a group.
  struct Gap {
    double from = 0.0, to = 0.0;
  };
  // By how much the first pixels past the change-point stand out from the other plane.
  struct Face {
    static constexpr std::int32_t kBins = 64;
    static constexpr double kBin_m = 0.002;
    std::array<std::int32_t, kBins> counts{};  // of offsets of 0, 2, ... mm; below 0 counts as 0
    bool tried = false;
  };
  // The groups' change-points, in the axes.
  struct Points {
    std::array<Vec2, kMaxGroups> at_m{};
    std::array<double, kMaxGroups> columns{};     // of the group
    std::array<double, kMaxGroups> weight{};      // less than these where a gap leaves open where the point is
    std::array<double, kMaxGroups> half_gap_m{};  // from there across to the first row beyond; negative against across
    std::array<double, kMaxGroups> scratch{};
    std::size_t count = 0;
    [[nodiscard]] double median_of_scratch() noexcept;
  };
  // across = a + b along, from lo to hi.
  struct Fit {
    double a = 0.0, b = 0.0;
    double lo_m = 0.0, hi_m = 0.0;
    double sigma_m = 0.0;     // at the line's ends: twice the one in the middle
    double half_gap_m = 0.0;  // mean of the points'
    [[nodiscard]] double at(double along_m) const noexcept { return a + b * along_m; }
  };
  // By how many rows the planes meet below where they meet as a whole, as the few rows on both sides say: what a slow
  // error of the camera adds to both planes' pixels at the edge does not move it there, but each plane's fit. Nosings
  // only: it takes .25 % of a frame's instructions.
  struct Shift {
    bool known = false;
    double start_px = 0.0, at_px = 0.0, per_column = 0.0;  // at_px at start_px
    double sigma_px = 0.0;                                 // at the line's ends
    [[nodiscard]] double at(double column_px) const noexcept {
      return at_px + per_column * (column_px - start_px) / kColumn_px;
    }
  };
  struct Windows;   // what kSlots columns are searched for, and where
  struct Found;     // what was found in them
  struct NearRows;  // rows on both sides of where the planes meet
  struct ShiftSums;

  [[nodiscard]] static double middle_px(std::int32_t column) noexcept {
    return kColumn_px * column + 0.5 * (kColumn_px - 1);
  }
  [[nodiscard]] Vec3 ray_at(double column_px, double row_px) const noexcept {
    return {(column_px - intrinsics_.cx_px) / intrinsics_.fx_px, (row_px - intrinsics_.cy_px) / intrinsics_.fy_px, 1.0};
  }
  void restart() noexcept;
  // kSlots columns from a multiple of kSlots on.
  void search_columns(std::int32_t first_column) noexcept;
  [[nodiscard]] Windows windows_of(std::int32_t first_column) const noexcept;
  void weigh_rows(const Windows& windows, Found& found) noexcept;
  void take_column(const Windows& windows, std::size_t slot, float near_rows) noexcept;
  void add_face(std::int32_t column, std::int32_t from_row, std::int32_t last_row) noexcept;
  // False when too few pixels stand out.
  [[nodiscard]] bool try_face_offset(double& offset_m) const noexcept;
  // A line through the change-points that holds for most columns.
  void gather_points() noexcept;
  // The middle of where the group's columns may change, and how far that reaches across.
  [[nodiscard]] bool try_group_point(const Group& group, Vec2& point_m, double& half_gap_m) noexcept;
  [[nodiscard]] bool try_on_surface(const Group& group, double outwards, Vec2& point_m) const noexcept;
  // The rows without data next to the change-point, the last one before which is at. False when there are none, or they
  // reach out of the window.
  enum class GapFound : std::uint8_t { kNone, kInside, kOutside };
  [[nodiscard]] GapFound find_gap(const Group& group, std::int32_t at, Gap& gap) noexcept;
  // Most columns were refused: where rows without data at the guess are why, the window is moved onto them and widened.
  [[nodiscard]] bool begins_at_gap() noexcept;
  // Between the first and the last row of the gap that a column has at its guess; false without one.
  [[nodiscard]] bool try_gap_of_column(std::int32_t column, Gap& gap) const noexcept;
  // Takes the gap's far end for the edge where the planes meet there; else what remains of it, and how uncertain it is.
  // apart_m: from the fit to where the planes meet.
  [[nodiscard]] EdgeLine seen_line(const Fit& fit) const noexcept;
  // The edge is anywhere from there to the gap's end; from: -1 where the gap begins, 1 where it ends.
  void widen_by_gap(Fit& fit, double from) const noexcept;
  [[nodiscard]] bool settle_gap(Fit& fit, double apart_m, double limit_m) const noexcept;
  [[nodiscard]] bool try_robust_line(Fit& fit, double& limit_m) noexcept;
  [[nodiscard]] Outcome measure(Fit& fit, double limit_m) const noexcept;
  // Where the planes meet, if that agrees with the fit, goes into the line's ends; false when the search is to begin
  // again, against an overhang's face.
  [[nodiscard]] bool try_meet_other(Fit& fit, EdgeLine& line) noexcept;
  [[nodiscard]] bool begins_at_face() noexcept;
  // All that is known of the edge at one place along it, by information: where across it lies, and its sigma.
  double join(const Fit& fit, const Shift& shift, double along_m, double meet_m, double& across_m) const noexcept;
  [[nodiscard]] double meet_m(double along_m) const noexcept;
  [[nodiscard]] double pixel_m(double along_m, double across_m) const noexcept;
  // Where across the surface the image's row is that many below the one of (along, across).
  [[nodiscard]] double below_m(double along_m, double across_m, double rows) const noexcept;
  [[nodiscard]] Shift local_shift() noexcept;
  void add_shifts(const NearRows& near, ShiftSums& sums) const noexcept;

  StaticVector<Guess, kColumns> guesses_;
  GuessLine guess_;

  Params params_;
  DepthNoiseModel noise_;
  CameraIntrinsics intrinsics_;
  const ColumnRays* rays_ = nullptr;
  const ColumnImage* image_ = nullptr;
  InversePlane surface_;
  OtherPlane other_;
  bool surface_above_ = true, drops_ = false;
  Axes axes_;
  std::array<Vec3, 2> guess_ends_m_{Vec3::Zero(), Vec3::Zero()};

  std::int32_t next_column_ = 0;
  std::array<Slots, kDepthHeight_px> gains_{};  // of the columns searched together, by row
  Groups groups_;
  Face face_;
  bool gap_tried_ = false;
  Points points_;
  WorkCount work_;
};

}  // namespace polygmap
