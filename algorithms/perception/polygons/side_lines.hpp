// SPDX-License-Identifier: Apache-2.0
// The left and right sides of a surface in the picture: where its rows of pixels end, one straight line through all.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

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

    static void visit(auto& p, auto& field) {
      field("truncate_sigmas", p.truncate_sigmas, 0.5, 20.0, "A pixel farther off its plane costs no more.");
      field("leave_sigmas", p.leave_sigmas, 0.1, 20.0,
            "A pixel as far off has left the surface when what lies beyond is no known plane.");
      field("max_lean", p.max_lean, 0.01, 10.0,
            "A side leans no more on the plane, along over across the picture's rows: a front or a back does.");
      field("inlier_px", p.inlier_px, 0.1, 20.0, "A row's end as near lies on the line.");
      field("outside_px", p.outside_px, 0.0, 50.0,
            "A pixel of the surface that lies farther outside the line is cut off by it.");
      field("max_cut", p.max_cut, 0.0, 1.0, "A line cuts off no more than this share of the surface's pixels.");
      field("min_rows", p.min_rows, 2, 240, "As many rows are looked at, and lie on the line.");
      field("min_share", p.min_share, 0.0, 1.0, "At least this share of the rows between the line's ends lies on it.");
    }
  };

  // All but the parameters are read again by find.
  void begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw, const FrameImage& picture,
             const Regions& regions) noexcept;
  // Of the next surface: the first and the last column of each of its rows.
  void find_ends(RegionId id) noexcept;
  // The line through the ends of that surface's rows on one side; not fitted, as far as the columns reach, where the
  // ends are not seen (the picture's or the robot's own) or not straight.
  [[nodiscard]] OutlineSide find(RegionId id, bool right) noexcept;

 private:
  static constexpr std::int32_t kMaxRows = 14;   // of a tread
  static constexpr std::int32_t kOtherRows = 8;  // of what nobody steps on
  // kHidden: by the picture's end, the robot's own body or missing data. kNone: the row's pixels there are not the
  // surface's.
  enum class Ending : std::uint8_t { kSeen, kHidden, kNone };
  struct RowView;  // what is seen around the end of one row
  void look(RegionId id, bool right, RowView& view) const noexcept;
  // Between which columns one row's pixels leave the surface (pixel c reaches from c - 0.5 to c + 0.5).
  [[nodiscard]] Ending end_of_row(const RowView& view, double& end_px) const noexcept;
  struct Line {  // column = at + slope * row
    double at = 0.0;
    double slope = 0.0;
  };
  [[nodiscard]] bool try_line(const InversePlane& plane, Line& line) const noexcept;

  struct RowEnd {
    double row, column;
  };
  Params params_;
  DepthNoiseModel noise_;
  const RawImage* raw_ = nullptr;
  const FrameImage* picture_ = nullptr;
  const Regions* regions_ = nullptr;
  double pitch_ = 0.0;                      // of rays from pixel to pixel
  static constexpr std::int32_t kPad = 32;  // rows before the first and after the last: whole registers
  using RowColumns = std::array<std::uint8_t, kDepthHeight_px + 2 * kPad>;
  static constexpr std::uint8_t kNoColumn = std::numeric_limits<std::uint8_t>::max();
  static_assert(kColumns <= kNoColumn);
  RowColumns left_{}, right_{};            // from kPad on; of the rows next to the surface's, too
  StaticVector<RowEnd, kMaxRows> seen_;    // full-resolution pixels
  StaticVector<RowEnd, kMaxRows> hidden_;  // as far as the columns reach
};

}  // namespace polygmap
