// SPDX-License-Identifier: Apache-2.0
// Where one plane ends and the next begins in every column, and the planes' final fit to what lies between.
//
// Two planes that meet in space meet in the image on a straight line that is known far better than any one column's
// pixels tell. Where they do not meet (an overhang, something in front), the columns' most likely change-points decide,
// all columns of a pair of planes together.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/noise_tracker.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/segments/scanline_segments.hpp"

namespace polygmap {

// Rows top .. bottom of a column show one plane.
struct ColumnSpan {
  std::int16_t top = 0;
  std::int16_t bottom = 0;
  PlaneId plane = kNoPlane;
  std::uint16_t component = 0;  // connected component of its plane's spans, numbered by ConnectedComponents
};

// Rows that belong to no plane are searched for the rest of known or cut-off surfaces this far from the nearest span's
// or the image's end; what lies deeper in them is clutter.
inline constexpr std::int32_t kRemainderReach_px = 48;

class SpanBoundaries {
 public:
  struct Params {
    double inlier_sigmas = 3.0;
    double same_gap_sigmas = 3.0;
    double gap_floor_m = 0.006;
    double meet_px = 2.0;
    double meet_gain = 1.0;
    std::int32_t window_px = 6;
    std::int32_t max_gap_px = 24;
    std::int32_t max_strip_px = 40;
    std::int32_t min_gap_rows = 3;
    std::int32_t max_empty_rows = 3;
    std::int32_t beside_px = 4;
    std::int32_t min_filled_rows = 2;
    std::int32_t thick_px = 8;

    static void visit(auto& p, auto& field) {
      field("inlier_sigmas", p.inlier_sigmas, 0.5, 20.0,
            "A row nearer to a plane counts in its refit, and extends the surface.");
      field("same_gap_sigmas", p.same_gap_sigmas, 0.5, 20.0,
            "Rows between two segments of one plane that are farther off it are something else.");
      field("gap_floor_m", p.gap_floor_m, 0.0, 0.1, "Slow depth errors, added to the noise of rows in a gap.");
      field("meet_px", p.meet_px, 0.0, 50.0, "Planes meet where their line is no farther from the change-point.");
      field("meet_gain", p.meet_gain, 0.0, 100.0,
            "Planes meet where their line costs no more than this of the columns' mean, too.");
      field("window_px", p.window_px, 1, 64, "As many rows are searched beyond where the segments ended.");
      field("max_gap_px", p.max_gap_px, 1, 480,
            "Surfaces with as many rows of something else between them are still next to each other.");
      field("max_strip_px", p.max_strip_px, 1, 480,
            "As many rows may lie between them if no more of these have depth: a strip along a nosing has none.");
      field.ordered("max_gap_px", "max_strip_px");
      field("min_gap_rows", p.min_gap_rows, 1, 100,
            "As many rows of something else part two segments of one plane, if they are half as many as its own.");
      field("max_empty_rows", p.max_empty_rows, 0, 100, "A surface is extended over no more rows without data.");
      field("beside_px", p.beside_px, 0, 64,
            "A plane in the column beside is looked for in as many rows more, above and below.");
      field("min_filled_rows", p.min_filled_rows, 1, 100,
            "A plane is given rows that are in no surface when as many in one stretch fit it.");
      field("thick_px", p.thick_px, 2, 480,
            "A surface of more rows in a column is refitted without the two next to others.");
    }
  };
  static constexpr std::size_t kMaxPlanes = 96;
  static constexpr std::size_t kMaxSpans = 32;
  static constexpr std::int32_t kRefitColumns = 8;  // per call, the same number for every vector width
  using Column = StaticVector<ColumnSpan, kMaxSpans>;
  using Columns = std::array<Column, kColumns>;
  struct Plane {
    InversePlane plane;
    Mat3 covariance = Mat3::Zero();  // of plane.m, zero while it is not measured
    float norm = 1.0F;               // of plane.m
    PlaneMoments moments;            // of the last refit, weights 1 / sigma^2
    double residual2 = 0.0;          // sum of squared normal distances, per pixel
    double seen_px = 0.0;  // measured in the rows refitted to, among them those that the plane does not explain
  };

  void begin(const Params& params, const DepthNoiseModel& noise, const ColumnRays& rays, double fy_px, double cy_px,
             const ColumnImage& image) noexcept;
  // Planes are set by the caller between the passes; 1-based.
  void set_plane(std::size_t i, const InversePlane& plane) noexcept {
    planes_[i].plane = plane;
    planes_[i].norm = static_cast<float>(plane.m.norm());
  }
  // A plane of few pixels is uncertain beside them: the gaps it may fill know that.
  void set_covariance(std::size_t i, const Mat3& covariance) noexcept { planes_[i].covariance = covariance; }
  [[nodiscard]] const Plane& plane(std::size_t i) const noexcept { return planes_[i]; }

  // One column's segments to spans, each segment's plane looked up in to_plane.
  void build_spans(std::int32_t column, const ScanlineSegmentation::Column& segments,
                   const std::array<std::uint8_t, kMaxPlanes + 1>& to_plane) noexcept;
  // A segment's ends may reach over an edge: takes away rows that the plane, known better than the segment's line, does
  // not explain.
  void trim_ends(std::int32_t column) noexcept;
  // Gives rows that are in none of the column's spans to planes that the column beside shows there, or to one of the
  // planes first .. last. Such rows are too few for a segment of their own.
  void fill_gaps(std::int32_t column, std::int32_t beside, std::size_t first, std::size_t last) noexcept;
  void begin_scores() noexcept;
  // Whether surfaces that end at the row bottom and begin at the row top are next to each other.
  [[nodiscard]] bool touch(std::int32_t column, std::int32_t bottom, std::int32_t top) noexcept;
  // Scores where the column's surfaces change, and ends its spans there. by_planes: where planes meet near a change,
  // that is believed unmeasured.
  void score(std::int32_t column, bool by_planes) noexcept;
  // Decides for each pair of planes how far its boundary lies from where the planes meet, by the scores of all columns,
  // and ends all its spans there: some of it, after begin_placing(); true when all is done.
  void begin_placing() noexcept { next_ = 0; }
  [[nodiscard]] bool place_some() noexcept;
  // Ends them there again, after the planes have changed: some, after begin_reprojecting(); true when all is done.
  void begin_reprojecting() noexcept { next_ = pair_count_; }
  [[nodiscard]] bool reproject_some() noexcept;
  void begin_refit() noexcept;
  // Adds kRefitColumns columns, the first a multiple of that, to their planes' moments: some strips of them, and true
  // after the last. roughly: of fewer of their rows, and without looking at the noise.
  [[nodiscard]] bool refit_some(std::int32_t first_column, bool roughly) noexcept;

  // The noise as the rows of the last refit's surfaces show it.
  [[nodiscard]] const NoiseSamples& noise_samples() const noexcept { return noise_samples_; }

  // visit(other plane, columns in which the two meet), of the last scores.
  template <typename Visit>
  void for_each_meeting(std::uint8_t plane, const Visit& visit) const noexcept {
    for (std::size_t i = 0; i < pair_count_; ++i) {
      const Pair& pair = pairs_[i];
      if (pair.upper == plane) visit(pair.lower, pair.columns);
      if (pair.lower == plane) visit(pair.upper, pair.columns);
    }
  }
  [[nodiscard]] std::size_t meetings() const noexcept { return pair_count_; }
  [[nodiscard]] Columns& columns() noexcept { return columns_; }
  [[nodiscard]] const Columns& columns() const noexcept { return columns_; }
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  static constexpr std::size_t kMaxJoints = 26 * static_cast<std::size_t>(kColumns);  // ten steps have 20 a column
  static constexpr std::uint8_t kMaxPairs = 192;
  static constexpr std::int32_t kRowsAtOnce = 8;
  static constexpr std::int32_t kBins = 32;  // of a pixel, -16 .. 16
  struct Joint {
    std::int16_t column = 0;
    std::uint8_t pair = 0;
    std::uint8_t upper = 0;  // span
  };
  struct Pair {
    std::uint8_t upper = 0;
    std::uint8_t lower = 0;
    double columns = 0.0;
    double shift_px = 0.0;  // of the boundary from where the planes meet
    // Sum of cost(upper) - cost(lower), by distance from where the planes meet: rows in the upper halves of the bins,
    // then those in the lower halves. Eight rows are added at once, beyond both ends, too.
    std::array<std::array<float, kBins + 2 * kRowsAtOnce>, 2> gain{};
  };
  static constexpr float kTruncation = 9.0F;  // of a cost: an outlier says no more than three sigmas do
  // A plane in one column: inverse depth a + b y, its tolerance per sigma, and its own variance, both times inverse
  // depth.
  struct Line {
    float a, b, norm, own = 0.0F;
  };
  [[nodiscard]] Line line_of(std::uint8_t plane, std::int32_t column) const noexcept;
  // A row against a line: residual over sigma, squared, is off2 / variance.
  struct Offset {
    float off2, variance;
    [[nodiscard]] bool within(float cost) const noexcept { return off2 < cost * variance; }
  };
  [[nodiscard]] Offset offset(const Line& line, std::int32_t column, std::int32_t row) const noexcept;
  void trim_ends(std::int32_t column, ColumnSpan& span) noexcept;
  struct Depths {  // the range of some rows' inverse depths, 1/m
    float farthest, nearest;
    [[nodiscard]] bool any() const noexcept { return nearest >= farthest; }
  };
  [[nodiscard]] Depths depths_of(std::int32_t column, std::int32_t first, std::int32_t last) const noexcept;
  [[nodiscard]] bool reaches(const Line& line, std::int32_t top, std::int32_t bottom,
                             const Depths& depths) const noexcept;
  // See Line.
  [[nodiscard]] float own_variance(std::uint8_t plane, std::int32_t column, std::int32_t row) const noexcept;
  struct Rows {  // a bit for each of kRowsAtOnce
    std::uint32_t measured = 0, fit = 0;
  };
  // Which of the rows from first on have data, and which of them lie on the line.
  [[nodiscard]] Rows fitting(const Line& line, std::int32_t column, std::int32_t first) const noexcept;
  // The candidate's longest stretch of rows that fit its plane, if that is more than most; then most is theirs.
  void weigh_candidate(std::int32_t column, const Line& line, const ColumnSpan& candidate, std::int32_t& most,
                       ColumnSpan& filled) noexcept;
  struct Gap {  // rows of a column between spans of two planes, 0 = none
    std::int32_t column, from, until;
    std::uint8_t above, below;
    [[nodiscard]] bool may_be(std::uint8_t plane) const noexcept { return plane != above && plane != below; }
  };
  // A plane for rows top .. bottom of the gap, whose depths are known; or several planes for its ends; or those of the
  // column beside, of whose spans next is the first that reaches down to the gap.
  void consider(const Gap& gap, std::uint8_t plane, std::int32_t top, std::int32_t bottom, const Depths& depths,
                std::int32_t& most, ColumnSpan& filled) noexcept;
  void consider(const Gap& gap, std::size_t first_plane, std::size_t last_plane, std::int32_t& most,
                ColumnSpan& filled) noexcept;
  void consider_beside(const Gap& gap, const Column& others, std::size_t& next, std::int32_t& most,
                       ColumnSpan& filled) noexcept;
  // One plane's rows in columns next to each other: top .. bottom of each, none when top > bottom.
  struct Strip {
    std::array<std::int16_t, kRefitColumns> top{}, bottom{};
    std::uint8_t plane = 0;
  };
  struct Front {  // the columns' spans that come next: their first rows and planes, kNone where there is none left
    static constexpr std::int16_t kNone = std::numeric_limits<std::int16_t>::max();
    std::array<std::int16_t, kRefitColumns> top{}, plane{};
  };
  struct StripRows;
  struct StripSums;
  [[nodiscard]] StripRows rows_of(const Strip& strip, bool roughly) const noexcept;
  void add_up(std::int32_t first_column, const Strip& strip, const StripRows& rows, StripSums& sums) const noexcept;
  // The topmost span that is left, and with it those of its plane that are next in the other columns; false: none.
  [[nodiscard]] bool take_strip(std::int32_t first_column, Front& front, Strip& strip) noexcept;
  void show_next(std::int32_t first_column, std::size_t slot, Front& front) const noexcept;
  void refit(std::int32_t first_column, const Strip& strip, bool roughly) noexcept;
  struct RowGains;
  struct BinnedGains;
  void place(Pair& pair) const noexcept;
  void reproject(const Joint& joint) noexcept;
  void extend(std::int32_t column, ColumnSpan& span, std::int32_t step, std::int32_t limit) noexcept;
  [[nodiscard]] std::int32_t change_point(std::int32_t column, const Line& upper, const Line& lower, std::int32_t first,
                                          std::int32_t last, float meeting_row, Pair* pair) noexcept;
  // The row, real, where the lines meet; not finite for parallel ones.
  [[nodiscard]] double meeting_row(const Line& upper, const Line& lower) const noexcept {
    return static_cast<double>(lower.a - upper.a) / static_cast<double>(upper.b - lower.b) * fy_px_ + cy_px_;
  }
  void sample_noise(std::int32_t column) noexcept;
  [[nodiscard]] std::uint8_t pair_of(std::uint8_t upper, std::uint8_t lower) noexcept;

  Params params_;
  const ColumnRays* rays_ = nullptr;
  const ColumnImage* image_ = nullptr;
  double fy_px_ = 1.0, cy_px_ = 0.0;
  InverseSigma<float> inverse_sigma_{};
  MeanShare<float> mean_share_{};
  std::array<float, kColumn_px + 1> share_{};  // of a pixel's variance that the mean of n pixels has

  std::array<Plane, kMaxPlanes + 1> planes_{};
  Columns columns_{};
  std::array<Joint, kMaxJoints> joints_{};
  std::size_t joint_count_ = 0;
  std::array<Pair, kMaxPairs> pairs_{};
  std::size_t pair_count_ = 0;
  std::array<std::array<std::uint8_t, kMaxPlanes + 1>, kMaxPlanes + 1> pair_of_{};  // by upper and lower
  NoiseSamples noise_samples_;
  std::uint32_t overflow_ = 0;
  std::array<std::uint8_t, kRefitColumns> next_span_{};  // of each column that is refitted
  std::size_t next_ = 0;                                 // pair to be placed, then, counted on, joint to be ended there
  WorkCount work_;
};

inline SpanBoundaries::Line SpanBoundaries::line_of(std::uint8_t plane, std::int32_t column) const noexcept {
  const auto x = static_cast<double>(rays_->x[static_cast<std::size_t>(column)]);
  const Vec3& m = planes_[plane].plane.m;
  return {static_cast<float>(m.x() * x + m.z()), static_cast<float>(m.y()), planes_[plane].norm};
}

inline SpanBoundaries::Offset SpanBoundaries::offset(const Line& line, std::int32_t column,
                                                     std::int32_t row) const noexcept {
  const float w = image_->by_column(row, column);
  const float residual = (w - (line.a + line.b * rays_->y[static_cast<std::size_t>(row)])) * w;
  const float sigma = inverse_sigma_(w) * line.norm;
  return {residual * residual, sigma * sigma * share_[image_->valid_by_column(row, column)]};
}

}  // namespace polygmap
