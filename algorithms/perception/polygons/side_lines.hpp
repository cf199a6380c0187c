// SPDX-License-Identifier: Apache-2.0
// The left and right sides of a surface in the image: where its rows of pixels end, one straight line through all.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/polygons/column_outline.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

class SideLines {
 public:
  struct Params {
    double truncate_sigmas = 3.0;
    double leave_sigmas = 2.0;
    double max_lean = 1.0;
    double inlier_px = 2.0;
    double outside_px = 3.0;
    double max_cut = 0.03;
    std::int32_t min_rows = 6;
    double min_share = 0.5;
    double least_incidence_cos = 0.26;
    std::int32_t flat_rows = 4;
    std::int32_t flat_columns = 2;
    std::int32_t mixed_px = 2;

    static void visit(auto& p, auto& field) {
      field("truncate_sigmas", p.truncate_sigmas, 0.5, 20.0, "A pixel farther off its plane costs no more.");
      field("leave_sigmas", p.leave_sigmas, 0.1, 20.0,
            "A pixel as far off has left the surface when what lies beyond is no known plane.");
      field("max_lean", p.max_lean, 0.01, 10.0,
            "A side leans no more on the plane, along over across the image's rows: a front or a back does.");
      field("inlier_px", p.inlier_px, 0.1, 20.0, "A row's end as near lies on the line.");
      field("outside_px", p.outside_px, 0.0, 50.0,
            "A pixel of the surface that lies farther outside the line is cut off by it.");
      field("max_cut", p.max_cut, 0.0, 1.0, "A line cuts off no more than this share of the surface's pixels.");
      field("min_rows", p.min_rows, 2, 240, "As many rows are looked at, and lie on the line.");
      field("min_share", p.min_share, 0.0, 1.0, "At least this share of the rows between the line's ends lies on it.");
      field(
          "least_incidence_cos", p.least_incidence_cos, 0.01, 1.0,
          "The noise of a pixel that is seen at a smaller cosine of the incidence is that at this one, where the noise "
          "model ends.");
      field("flat_rows", p.flat_rows, 2, 16,
            "The end of a row is compared with those half as many rows above and below.");
      field("flat_columns", p.flat_columns, 0, 40,
            "A surface's end that runs off by more columns of eight pixels within flat_rows is a front or a back.");
      field(
          "mixed_px", p.mixed_px, 0, 16,
          "As many pixels of neither plane may lie between two where one pixel sees both; more are something narrow.");
    }
  };

  // All but the parameters are read again by find.
  void begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw, const FrameImage& image,
             const Regions& regions) noexcept;
  // Of the next surface: the first and the last column of each of its rows.
  void find_ends(RegionId id) noexcept;
  // The line through the ends of that surface's rows on one side; not fitted, as far as the columns reach, where the
  // ends are not seen (the image's or the robot's own) or not straight.
  [[nodiscard]] OutlineSide find(RegionId id, bool right) noexcept;
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  static constexpr std::int32_t kMaxRows = 14;   // of a tread
  static constexpr std::int32_t kOtherRows = 8;  // of what nobody steps on
  // kHidden: by the image's end, the robot's own body or missing data. kNone: the row's pixels there are not the
  // surface's.
  enum class Ending : std::uint8_t { kSeen, kHidden, kNone };
  struct RowView;  // what is seen around the end of one row
  struct Views;
  struct UprightRows;
  [[nodiscard]] UprightRows upright_rows(const ColumnExtents& profile, const std::uint8_t* ends) const noexcept;
  // Rows at equal distances among those.
  void choose_rows(const UprightRows& rows, std::int32_t most, const std::uint8_t* ends, Views& views) const noexcept;
  void look(RegionId id, bool right, RowView& view) const noexcept;
  [[nodiscard]] RegionId plane_beyond(RegionId id, std::int32_t out, const RowView& view) const noexcept;
  // How many of those of its pixels, from inside outwards, that are searched are in the image and not the robot's own.
  [[nodiscard]] std::int32_t count_free(bool right, const RowView& view) const noexcept;
  void copy_pixels(bool right, std::int32_t count, RowView& view) const noexcept;
  // Between which columns one row's pixels leave the surface (pixel c reaches from c - 0.5 to c + 0.5).
  [[nodiscard]] Ending end_of_row(const RowView& view, double& end_px) const noexcept;
  // Where the rows end, into seen_ and hidden_; the outermost of those columns, times out.
  double find_row_ends(const Views& views, bool right) noexcept;
  struct Line {  // column = at + slope * row
    double at = 0.0;
    double slope = 0.0;
  };
  [[nodiscard]] bool try_line(const InversePlane& plane, Line& line) const noexcept;
  [[nodiscard]] bool try_propose(const InversePlane& plane, Line& line) const noexcept;
  [[nodiscard]] bool is_upright(const InversePlane& plane, const Line& line) const noexcept;
  // Whether enough of the rows that were looked at end on the line; between which rows those are.
  [[nodiscard]] bool holds(const Line& line, double& first_row, double& last_row) const noexcept;
  // Of the surface's pixels.
  [[nodiscard]] double count_outside(const Line& line, const ColumnExtents& profile, bool right) const noexcept;

  struct RowEnd {
    double row, column;
  };
  Params params_;
  DepthNoiseModel noise_;
  const RawImage* raw_ = nullptr;
  const FrameImage* image_ = nullptr;
  const Regions* regions_ = nullptr;
  double pitch_ = 0.0;                      // of rays from pixel to pixel
  static constexpr std::int32_t kPad = 32;  // rows before the first and after the last: whole registers
  using RowColumns = std::array<std::uint8_t, kDepthHeight_px + 2 * kPad>;
  static constexpr std::uint8_t kNoColumn = std::numeric_limits<std::uint8_t>::max();
  static_assert(kColumns <= kNoColumn);
  [[nodiscard]] const std::uint8_t* ends_of(bool right) const noexcept {
    return (right ? right_ : left_).data() + kPad;
  }
  RowColumns left_{}, right_{};            // from kPad on; of the rows next to the surface's, too
  StaticVector<RowEnd, kMaxRows> seen_;    // full-resolution pixels
  StaticVector<RowEnd, kMaxRows> hidden_;  // as far as the columns reach
  WorkCount work_;
};

}  // namespace polygmap
