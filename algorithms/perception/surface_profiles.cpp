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
                                 std::int32_t column, FramePicture& picture) noexcept {
  std::uint8_t* owners = picture.owners.row(column);
  std::fill(owners, owners + kDepthHeight_px, std::uint8_t{0});
  for (const ColumnSpan& span : columns[static_cast<std::size_t>(column)]) {
    const std::uint8_t surface = span.piece == 0 ? std::uint8_t{0} : pieces.plane_of(span.piece);
    if (surface == 0) continue;
    std::fill(owners + span.top, owners + span.bottom + 1, surface);
    profiles_[surface].add(column, span.top, span.bottom);
  }
}

}  // namespace polygmap
