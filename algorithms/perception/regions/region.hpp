// SPDX-License-Identifier: Apache-2.0
// The regions of one frame's picture: what shows one plane and hangs together, which pixels it has, and where it begins
// and ends in every column.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/raster.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/regions/column_extents.hpp"

namespace polygmap {

// The number of a region in its frame, from 1 on. The first region of a plane has the plane's number.
using RegionId = PlaneId;
inline constexpr RegionId kNoRegion = 0;

struct Region {
  // What its plane's fit says.
  InversePlane plane;
  SurfaceKind kind = SurfaceKind::kOther;
  Mat3 covariance = Mat3::Zero();  // of plane.m
  double rmse_m = 0.0;             // of all pixels of the plane
  PlaneId source = kNoPlane;       // the plane that was fitted
  // What connected components say.
  RegionId coplanar = kNoRegion;  // the first of the regions that count as one plane with this one
  std::uint16_t main_component = 0;
  double area_px = 0.0;
  Vec3 centre_m = Vec3::Zero();
  bool alive = false;  // until some stage gives it up
};

// The region of every row of every column.
struct LabelImage {
  Raster<RegionId, kDepthHeight_px, kColumns> by_column;  // a column a line
  [[nodiscard]] RegionId at(std::int32_t column, std::int32_t row) const noexcept { return by_column(row, column); }
  [[nodiscard]] RegionId& at(std::int32_t column, std::int32_t row) noexcept { return by_column(row, column); }
  [[nodiscard]] RegionId* column(std::int32_t g) noexcept { return by_column.row(g); }
  [[nodiscard]] const RegionId* column(std::int32_t g) const noexcept { return by_column.row(g); }
};

struct Regions {
  static constexpr std::size_t kMaxRegions = PlaneSet::kMaxPlanes;
  std::array<Region, kMaxRegions + 1> regions;  // by RegionId; [kNoRegion] is never alive
  RegionId count = 0;
  LabelImage labels;
  std::array<ColumnExtents, kMaxRegions + 1> extents{};  // of regions that are alive

  [[nodiscard]] Region& operator[](std::size_t i) noexcept { return regions[i]; }
  [[nodiscard]] const Region& operator[](std::size_t i) const noexcept { return regions[i]; }
};

}  // namespace polygmap
