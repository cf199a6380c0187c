// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/pixel_owner.hpp"

namespace polygmap {
namespace {

constexpr double kSteepest = 1.0;  // rows per pixel that a boundary may climb
constexpr std::int32_t kReach_px = kColumn_px / 2;
constexpr double kRounded_px = 0.51;  // between a boundary and the row it was rounded to
constexpr double kParallel_px = 16.0;  // a boundary this near to where its planes meet runs along with that line

// Where two planes meet in one column of pixels, real rows; slope: rows per pixel to the right.
struct Meeting {
  double row = 0.0, slope = 0.0;
  Meeting(const InversePlane& upper, const InversePlane& lower, const FramePicture& picture, double x) noexcept {
    const ColumnRays& rays = picture.column_rays;
    const Vec3 d = lower.m - upper.m;
    const double first = static_cast<double>(rays.y[0]), pitch = static_cast<double>(rays.y[1]) - first;
    row = (-(d.x() * x + d.z()) / d.y() - first) / pitch;
    slope = -d.x() / d.y() / (2.0 * picture.rays.fx_px * pitch);
  }
};

// Whether a row belongs to the upper of two planes whose boundary in the column's middle is last_upper; off_px: from
// that middle.
bool is_upper(const FramePicture& picture, const InversePlane& upper, const InversePlane& lower, std::int32_t column,
              double off_px, std::int32_t last_upper, std::int32_t row) noexcept {
  const Meeting meeting(upper, lower, picture,
                        static_cast<double>(picture.column_rays.x[static_cast<std::size_t>(column)]));
  const double rounded = last_upper + 0.5, apart_px = std::abs(meeting.row - rounded);
  if (!(std::abs(meeting.slope) <= kSteepest) || !(apart_px < kParallel_px)) return row <= last_upper;
  const double middle = apart_px < kRounded_px ? meeting.row : rounded;
  return row < middle + meeting.slope * off_px;
}

}  // namespace

std::size_t pixel_owner(const FramePicture& picture, const FramePlanes& planes, std::int32_t column,
                        std::int32_t row) noexcept {
  const std::int32_t g = column / kColumn_px;
  const double off_px = column - kColumn_px * g - 0.5 * (kColumn_px - 1);
  const std::size_t own = picture.owner(g, row);
  if (own == 0) return 0;
  for (std::int32_t k = 1; k <= kReach_px; ++k) {
    for (const std::int32_t side : {k, -k}) {
      if (row + side < 0 || row + side >= picture.column_rays.height_px) continue;
      const std::size_t other = picture.owner(g, row + side);
      if (other == own) continue;
      if (other == 0) return own;
      const bool below = side > 0;
      const InversePlane &upper = planes[below ? own : other].plane, &lower = planes[below ? other : own].plane;
      const bool of_upper = is_upper(picture, upper, lower, g, off_px, below ? row + side - 1 : row + side, row);
      return of_upper == below ? own : other;
    }
  }
  return own;
}

}  // namespace polygmap
