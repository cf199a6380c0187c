// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_profiles.hpp"

#include <algorithm>

namespace polygmap {

void SurfaceProfiles::begin(std::size_t planes, FramePicture& picture) noexcept {
  picture.owners.fill(0);
  for (std::size_t p = 1; p <= planes; ++p) profiles_[p] = SurfaceProfile{};
}

void SurfaceProfiles::add_column(const SurfaceBoundaries::Columns& columns, const SurfacePieces& pieces,
                                 const FramePlanes& planes, std::int32_t column, FramePicture& picture) noexcept {
  const auto surface_of = [&](const ColumnSpan& span) {
    const std::uint8_t plane = span.piece == 0 ? std::uint8_t{0} : pieces.plane_of(span.piece);
    return planes[plane].alive ? plane : std::uint8_t{0};
  };
  // Calls end_at for the rows of a span in which the column beside it does not show the same surface.
  const auto rows_alone = [&](const ColumnSpan& span, std::uint8_t surface, std::int32_t beside, const auto& end_at) {
    std::int32_t row = span.top;
    if (beside >= 0 && beside < picture.column_rays.columns) {
      for (const ColumnSpan& other : columns[static_cast<std::size_t>(beside)]) {  // from top to bottom
        if (other.bottom < row || other.top > span.bottom || surface_of(other) != surface) continue;
        for (; row < other.top; ++row) end_at(static_cast<std::size_t>(row));
        row = other.bottom + 1;
      }
    }
    for (; row <= span.bottom; ++row) end_at(static_cast<std::size_t>(row));
  };
  for (const ColumnSpan& span : columns[static_cast<std::size_t>(column)]) {
    const std::uint8_t surface = surface_of(span);
    if (surface == 0) continue;
    std::uint8_t* owners = picture.owners.row(column);
    std::fill(owners + span.top, owners + span.bottom + 1, surface);
    SurfaceProfile& profile = profiles_[surface];
    profile.columns[static_cast<std::size_t>(column)].add(span.top, span.bottom);
    profile.first_row = std::min(profile.first_row, span.top);
    profile.last_row = std::max(profile.last_row, span.bottom);
    const auto here = static_cast<SurfaceProfile::Column>(column);
    rows_alone(span, surface, column - 1, [&](std::size_t row) {
      if (profile.left[row] == SurfaceProfile::kNoColumn) profile.left[row] = here;
    });
    rows_alone(span, surface, column + 1, [&](std::size_t row) { profile.right[row] = here; });
  }
}

}  // namespace polygmap
