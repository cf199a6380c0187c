// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/pixel_labels.hpp"

#include <limits>

namespace polygmap {
namespace {

// Pictures and tests ask for pixels, and nothing that is published depends on them: none of these is a parameter.
constexpr double kSteepest = 2.0;  // rows per pixel that a boundary may climb
constexpr std::int32_t kReach_px = kColumn_px;
constexpr double kRounded_px = 0.51;   // between a boundary and the row it was rounded to
constexpr double kParallel_px = 16.0;  // a boundary this near to where its planes meet runs along with that line
constexpr double kNosing_px = 4.0;     // a boundary this near to a nosing is that nosing

// Where a line crosses a column of pixels; not a number beyond its ends.
double row_of(const CameraIntrinsics& k, const EdgeLine& line, std::int32_t column) noexcept {
  const auto project = [&k](const Vec3& p_m) {
    return Vec2{k.cx_px + k.fx_px * p_m.x() / p_m.z(), k.cy_px + k.fy_px * p_m.y() / p_m.z()};
  };
  const Vec2 a = project(line.a_m), b = project(line.b_m);
  const double share = (column - a.x()) / (b.x() - a.x());
  if (!line.valid || !(share >= 0.0 && share <= 1.0)) return std::numeric_limits<double>::quiet_NaN();
  return a.y() + share * (b.y() - a.y());
}

// Whether a row belongs to the upper of two planes. last_upper: where it ends in the middle of the column of eight
// pixels, off_px to the left.
bool is_upper(const CameraIntrinsics& k, const InversePlane& upper, const InversePlane& lower, double middle_px,
              double off_px, std::int32_t last_upper, std::int32_t row) noexcept {
  // The planes meet where d . ray = 0.
  const Vec3 d = lower.m - upper.m;
  const double slope = -d.x() / d.y() * k.fy_px / k.fx_px;  // rows per pixel
  const double meeting = k.cy_px - (d.x() * (middle_px - k.cx_px) / k.fx_px + d.z()) / d.y() * k.fy_px;
  const double rounded = last_upper + 0.5, apart_px = std::abs(meeting - rounded);
  if (!(std::abs(slope) <= kSteepest) || !(apart_px < kParallel_px)) return row <= last_upper;
  return row < (apart_px < kRounded_px ? meeting : rounded) + slope * off_px;
}

// Of a plane, in standard deviations; more than kOff where nothing is measured.
constexpr double kOff = 3.0;
double residual(const FrameImage& image, const RawImage& raw, const DepthNoiseModel& noise, const InversePlane& plane,
                std::int32_t column, std::int32_t row) noexcept {
  const std::uint16_t depth = raw.row(row)[column];
  if (!raw.range.valid(depth) || image.body(column / 2, row / 2)) return 2.0 * kOff;
  const CameraIntrinsics& k = raw.intrinsics;
  const double w = 1.0 / (depth * k.depth_unit_m);
  const Vec3 ray{(column - k.cx_px) / k.fx_px, (row - k.cy_px) / k.fy_px, 1.0};
  return std::abs(w - plane.inverse_depth(ray)) * w / (plane.m.norm() * noise.inverse_sigma(w));
}

// A column without a label may be one in which two things are seen: its pixels up to where they leave the surface that
// the column beside it shows are that surface's.
RegionId label_beside(const FrameImage& image, const RawImage& raw, const DepthNoiseModel& noise,
                      const Regions& regions, std::int32_t column, std::int32_t row) noexcept {
  const std::int32_t g = column / kColumn_px, columns = image.column_rays.columns;
  RegionId best = kNoRegion;
  double least = kOff;
  for (const std::int32_t side : {-1, 1}) {
    if (g + side < 0 || g + side >= columns) continue;
    const RegionId p = regions.labels.at(g + side, row);
    if (p == kNoRegion || p == best) continue;
    bool ends_here = false;  // the column itself says in which of its rows the surface ends
    for (std::int32_t k = 1; k <= kReach_px && !ends_here; ++k) {
      ends_here = regions.labels.at(g, std::max(row - k, 0)) == p ||
                  regions.labels.at(g, std::min(row + k, image.column_rays.height_px - 1)) == p;
    }
    if (ends_here) continue;
    const std::int32_t nearest = side < 0 ? kColumn_px * g : kColumn_px * g + kColumn_px - 1;
    std::int32_t off = 0;
    for (std::int32_t c = nearest; c != column && off < 2; c -= side) {
      off += residual(image, raw, noise, regions[p].plane, c, row) < kOff ? 0 : 1;
    }
    const double own = residual(image, raw, noise, regions[p].plane, column, row);
    if (off >= 2 || !(own < least)) continue;
    least = own;
    best = p;
  }
  return best;
}

// Of a row next to a border: its column says own, and another region side rows away.
RegionId label_at_border(const RawImage& raw, const Regions& regions, const PublishedSurfaces& published, RegionId own,
                         RegionId other, std::int32_t column, std::int32_t row, std::int32_t side) noexcept {
  const double middle_px = column - column % kColumn_px + 0.5 * (kColumn_px - 1);
  const bool below = side > 0;
  const RegionId above = below ? own : other;
  const Region &upper = regions[above], &lower = regions[below ? other : own];
  const std::int32_t last_upper = below ? row + side - 1 : row + side;
  // A nosing knows more than where two planes meet: what its own rows say, too.
  const double nosing = lower.kind == SurfaceKind::kRiser ? row_of(raw.intrinsics, published[above].nosing, column)
                                                          : std::numeric_limits<double>::quiet_NaN();
  const bool of_upper =
      std::abs(nosing - (last_upper + 0.5)) < kNosing_px
          ? row < nosing
          : is_upper(raw.intrinsics, upper.plane, lower.plane, middle_px, column - middle_px, last_upper, row);
  return of_upper == below ? own : other;
}

}  // namespace

RegionId pixel_label(const FrameImage& image, const RawImage& raw, const DepthNoiseModel& noise, const Regions& regions,
                     const PublishedSurfaces& published, std::int32_t column, std::int32_t row) noexcept {
  const std::int32_t g = column / kColumn_px;
  const RegionId own = regions.labels.at(g, row);
  if (own == kNoRegion) {
    return raw.depth != nullptr ? label_beside(image, raw, noise, regions, column, row) : kNoRegion;
  }
  for (std::int32_t k = 1; k <= kReach_px; ++k) {
    for (const std::int32_t side : {k, -k}) {
      if (row + side < 0 || row + side >= image.column_rays.height_px) continue;
      const RegionId other = regions.labels.at(g, row + side);
      if (other == own) continue;
      if (other == kNoRegion) return own;
      return label_at_border(raw, regions, published, own, other, column, row, side);
    }
  }
  return own;
}

}  // namespace polygmap
