// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/column_extents.hpp"

#include <algorithm>

namespace polygmap {

void SurfaceExtents::begin(const PlaneSet& planes) noexcept {
  for (std::size_t p = 1; p <= planes.count; ++p) {
    if (planes[p].alive) profiles_[p] = ColumnExtents{};
  }
}

void SurfaceExtents::add_column(const SpanBoundaries::Columns& columns, const ConnectedComponents& pieces,
                                std::int32_t column, FrameImage& picture) noexcept {
  std::uint8_t* owners = picture.owners.row(column);
  std::fill(owners, owners + kDepthHeight_px, std::uint8_t{0});
  for (const ColumnSpan& span : columns[static_cast<std::size_t>(column)]) {
    const std::uint8_t surface = span.component == 0 ? std::uint8_t{0} : pieces.plane_of(span.component);
    if (surface == 0) continue;
    std::fill(owners + span.top, owners + span.bottom + 1, surface);
    profiles_[surface].add(column, span.top, span.bottom);
  }
}

}  // namespace polygmap
