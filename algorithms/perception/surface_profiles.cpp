// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_profiles.hpp"

#include <algorithm>

namespace polygmap {

void SurfaceProfiles::begin(const FramePlanes& planes) noexcept {
  for (std::size_t p = 1; p <= planes.count; ++p) {
    if (planes[p].alive) profiles_[p] = SurfaceProfile{};
  }
}

void SurfaceProfiles::add_column(const SurfaceBoundaries::Columns& columns, const SurfacePieces& pieces,
                                 const FramePlanes& planes, std::int32_t column, FramePicture& picture) noexcept {
  const auto surface_of = [&](const ColumnSpan& span) {
    const std::uint8_t plane = span.piece == 0 ? std::uint8_t{0} : pieces.plane_of(span.piece);
    return planes[plane].alive ? plane : std::uint8_t{0};
  };
  // Calls end_at for the stretches of a span's rows, first .. last - 1, in which the column beside it does not show the
  // same surface.
  // next: of the column beside, the first span that ends no higher than this one begins.
  const auto rows_alone = [&](const ColumnSpan& span, std::uint8_t surface, std::int32_t beside, std::size_t& next,
                              const auto& end_at) {
    std::int32_t row = span.top;
    if (beside >= 0 && beside < picture.column_rays.columns) {
      const SurfaceBoundaries::Column& others = columns[static_cast<std::size_t>(beside)];
      while (next < others.size() && others[next].bottom < row) ++next;
      for (std::size_t i = next; i < others.size() && others[i].top <= span.bottom; ++i) {  // from top to bottom
        const ColumnSpan& other = others[i];
        if (surface_of(other) != surface) continue;
        if (row < other.top) end_at(row, other.top);
        row = other.bottom + 1;
      }
    }
    if (row <= span.bottom) end_at(row, span.bottom + 1);
  };
  std::uint8_t* owners = picture.owners.row(column);
  std::fill(owners, owners + kDepthHeight_px, std::uint8_t{0});
  std::size_t next_left = 0, next_right = 0;
  for (const ColumnSpan& span : columns[static_cast<std::size_t>(column)]) {
    const std::uint8_t surface = surface_of(span);
    if (surface == 0) continue;
    std::fill(owners + span.top, owners + span.bottom + 1, surface);
    SurfaceProfile& profile = profiles_[surface];
    profile.columns[static_cast<std::size_t>(column)].add(span.top, span.bottom);
    profile.first_row = std::min(profile.first_row, span.top);
    profile.last_row = std::max(profile.last_row, span.bottom);
    const auto here = static_cast<SurfaceProfile::Column>(column);
    rows_alone(span, surface, column - 1, next_left, [&](std::int32_t first, std::int32_t last) {
      // kNoColumn is more than any column, and columns come in order.
      SurfaceProfile::Column* left = profile.left.data();
      for (std::int32_t row = first; row < last; ++row) left[row] = std::min(left[row], here);
    });
    rows_alone(span, surface, column + 1, next_right, [&](std::int32_t first, std::int32_t last) {
      std::fill(profile.right.data() + first, profile.right.data() + last, here);
    });
  }
}

}  // namespace polygmap
