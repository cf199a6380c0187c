// SPDX-License-Identifier: Apache-2.0
// Whose each pixel is, and where every surface begins and ends in the picture's columns.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/column_outline.hpp"
#include "algorithms/perception/frame_planes.hpp"
#include "algorithms/perception/surface_boundaries.hpp"
#include "algorithms/perception/surface_pieces.hpp"

namespace polygmap {

class SurfaceProfiles {
 public:
  void begin(const FramePlanes& planes) noexcept;
  // Columns come from left to right. Writes the column's owners into the picture.
  void add_column(const SurfaceBoundaries::Columns& columns, const SurfacePieces& pieces, std::int32_t column,
                  FramePicture& picture) noexcept;
  [[nodiscard]] const SurfaceProfile& operator[](std::size_t plane) const noexcept { return profiles_[plane]; }

 private:
  std::array<SurfaceProfile, FramePlanes::kMaxPlanes + 1> profiles_{};
};

}  // namespace polygmap
