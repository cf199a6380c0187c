// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_profiles.hpp"

#include <algorithm>

#include "algorithms/perception/back_projection.hpp"

namespace polygmap {
namespace {

// Whether the column beside a span shows the same plane.
bool continues(const SurfaceBoundaries& boundaries, std::int32_t column, std::int32_t columns,
               const ColumnSpan& span) noexcept {
  if (column < 0 || column >= columns) return false;
  for (const ColumnSpan& other : boundaries.columns()[static_cast<std::size_t>(column)]) {
    if (other.plane == span.plane && other.bottom >= span.top && other.top <= span.bottom) return true;
  }
  return false;
}

// Whether most measured pixels of a half-resolution column lie on the span's plane, in the span's rows.
bool shows(const RawPicture& raw_picture, const DepthSigma& noise, std::int32_t half_width_px,
           const InversePlane& plane, std::int32_t half_column, const ColumnSpan& span) noexcept {
  constexpr std::int32_t kSamples = 12;
  constexpr double kFloor_m = 0.003;
  if (half_column < 0 || half_column >= half_width_px) return false;
  const std::int32_t stride = std::max((span.bottom - span.top) / kSamples, 1);
  std::int32_t all = 0, on = 0;
  for (std::int32_t r = span.top; r <= span.bottom; r += stride) {
    for (const std::int32_t c : {2 * half_column, 2 * half_column + 1}) {
      const std::uint16_t raw = (*raw_picture.depth)(c, r);
      if (!raw_picture.range.valid(raw)) continue;
      const double z = raw * raw_picture.intrinsics.depth_unit_m;
      const Vec3 point = back_project(raw_picture.intrinsics, c, r, z);
      ++all;
      on += std::abs(plane.distance_m(point)) < kFloor_m + 3.0 * noise.sigma_m(z) ? 1 : 0;
    }
  }
  return 2 * on > all;
}

}  // namespace

void SurfaceProfiles::begin(std::size_t planes, FramePicture& picture) noexcept {
  picture.owner.fill(0);
  for (std::size_t p = 1; p <= planes; ++p) profiles_[p] = SurfaceProfile{};
}

// Whose a column's rows are, and where each surface begins and ends in it.
void SurfaceProfiles::add_column(const RawPicture& raw, const DepthSigma& noise, const SurfaceBoundaries& boundaries,
                                 const SurfacePieces& pieces, const FramePlanes& planes, std::int32_t g,
                                 FramePicture& picture) noexcept {
  const std::int32_t columns = picture.column_rays.columns;
  for (const ColumnSpan& span : boundaries.columns()[static_cast<std::size_t>(g)]) {
    const std::uint8_t plane = span.piece == 0 ? std::uint8_t{0} : pieces.plane_of(span.piece);
    if (plane == 0 || !planes[plane].alive) continue;
    for (std::int32_t r = span.top; r <= span.bottom; ++r) picture.owner(g, r) = plane;
    const bool left_end = !continues(boundaries, g - 1, columns, span),
               right_end = !continues(boundaries, g + 1, columns, span);
    const auto shown = [&](std::int32_t half_column) {
      return shows(raw, noise, picture.rays.width_px, boundaries.plane(span.plane).plane, half_column, span);
    };
    // A column is four pixels wide: at a surface's side the pixels themselves say how far it goes.
    std::int32_t first = 2 * g, last = 2 * g + 1;
    if (left_end) {
      while (first < last && !shown(first)) ++first;
      while (first <= 2 * g && first > 2 * g - 2 && shown(first - 1)) --first;
    }
    if (right_end) {
      while (last > first && !shown(last)) --last;
      while (last > 2 * g && last < 2 * g + 3 && shown(last + 1)) ++last;
    }
    SurfaceProfile& profile = profiles_[plane];
    profile.columns[static_cast<std::size_t>(g)].add(span.top, span.bottom);
    profile.left = std::min(profile.left, first);
    profile.right = std::max(profile.right, last);
  }
}

}  // namespace polygmap
