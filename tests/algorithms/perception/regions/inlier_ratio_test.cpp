// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/inlier_ratio.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace polygmap {
namespace {

// A surface in columns 20 and 21, rows 100 .. 299, of a picture whose pixels there are alternately of two depths.
double ratio(double even_z_m, double odd_z_m, double plane_z_m, bool measured = true) {
  const CameraIntrinsics k{640, 480, 460.0, 460.0, 319.5, 239.5, 0.001};
  const auto picture = std::make_unique<FrameImage>();
  picture->rays.set(k);
  picture->column_rays.set(k);
  const auto regions = std::make_unique<Regions>();
  regions->count = 1;
  regions->labels.by_column.fill(kNoRegion);
  std::vector<std::uint16_t> depth(std::size_t{640} * 480, 0);
  for (std::int32_t r = 100; r < 300; ++r) {
    for (std::int32_t c = 160; c < 176 && measured; ++c) {
      depth[static_cast<std::size_t>(640 * r + c)] =
          static_cast<std::uint16_t>(1000.0 * (c % 2 == 0 ? even_z_m : odd_z_m) + 0.5);
    }
  }
  for (const std::int32_t g : {20, 21}) {
    for (std::int32_t r = 100; r < 300; ++r) regions->labels.at(g, r) = 1;
    regions->extents[1].add(g, 100, 299);
  }
  RawImage raw;
  raw.depth = depth.data();
  raw.intrinsics = k;
  raw.range.set({}, k.depth_unit_m);
  (*regions)[1].plane.m = Vec3::UnitZ() / plane_z_m;
  (*regions)[1].area_px = 200.0 * 16.0;
  return inlier_ratio(*picture, raw, {}, *regions, 1, 3.0);
}

TEST(InlierRatio, PixelsOnThePlane_AllSaySo) { EXPECT_EQ(ratio(2.0, 2.0, 2.0), 1.0); }
TEST(InlierRatio, MeanOfAPoleAndTheWallBehindIt_HasNoPixel) { EXPECT_EQ(ratio(2.0, 3.0, 2.4), 0.0); }
TEST(InlierRatio, HalfThePixelsBehindThePlane_IsHalf) { EXPECT_NEAR(ratio(2.0, 3.0, 2.0), 0.5, 0.05); }
TEST(InlierRatio, NothingMeasured_SaysNothingAgainstIt) { EXPECT_EQ(ratio(2.0, 2.0, 2.0, false), 1.0); }

}  // namespace
}  // namespace polygmap
