// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/depth_reduction.hpp"

#include <gtest/gtest.h>

#include <array>

namespace polygmap {
namespace {

struct Cell {
  double depth_m;
  std::uint8_t flags;
};

Cell reduce(std::array<std::uint16_t, 4> raw) {
  DepthReduction reduction;
  reduction.set({}, 0.001);
  const std::array<std::uint16_t, 2> upper{raw[0], raw[1]}, lower{raw[2], raw[3]};
  float w = -1.0F;
  Cell cell{};
  reduction.reduce_row(upper.data(), lower.data(), 1, &w, &cell.flags);
  cell.depth_m = w > 0.0F ? 1.0 / static_cast<double>(w) : 0.0;
  return cell;
}

TEST(DepthReduction, Cell_FourValid_IsTheMeanOfTheMiddleTwo) {
  EXPECT_NEAR(reduce({1000, 1004, 1002, 1008}).depth_m, 1.003, 1e-6);
  EXPECT_NEAR(reduce({1008, 1000, 1004, 1002}).depth_m, 1.003, 1e-6);
}

TEST(DepthReduction, Cell_OneFlyingPixel_DoesNotMoveIt) {
  EXPECT_NEAR(reduce({1000, 1002, 1450, 1001}).depth_m, 1.0015, 1e-6);
  EXPECT_NEAR(reduce({1000, 0, 1450, 1001}).depth_m, 1.001, 1e-6);
}

TEST(DepthReduction, Cell_SplitByAJump_TakesTheNearerSurfaceAndNeverAMean) {
  EXPECT_NEAR(reduce({1000, 1002, 1300, 1302}).depth_m, 1.001, 1e-6);
  EXPECT_NEAR(reduce({1300, 0, 0, 1000}).depth_m, 1.0, 1e-6);
  EXPECT_NEAR(reduce({1000, 1300, 1302, 0}).depth_m, 1.3, 1e-6);  // of three, two outvote one
}

TEST(DepthReduction, Cell_FewValid_UsesThem) {
  EXPECT_NEAR(reduce({0, 0, 800, 0}).depth_m, 0.8, 1e-6);
  EXPECT_NEAR(reduce({802, 0, 800, 0}).depth_m, 0.801, 1e-6);
  EXPECT_EQ(reduce({802, 0, 800, 0}).flags, kPixelMeasured);
}

TEST(DepthReduction, Cell_NothingInRange_IsEmpty) {
  EXPECT_EQ(reduce({0, 0, 0, 0}).flags, 0);
  EXPECT_EQ(reduce({65535, 65535, 65535, 65535}).flags, 0);
  EXPECT_EQ(reduce({50, 60000, 0, 65535}).flags, 0);  // 50 mm and 60 m
  EXPECT_EQ(reduce({50, 60000, 0, 65535}).depth_m, 0.0);
}

TEST(FillHoles, HoleOfTwoPixels_GetsTheMeanAround_BodyStaysEmpty) {
  static InverseDepthImage measured;
  static HalfImage<std::uint8_t> flags;
  measured.fill(2.0F);
  flags.fill(kPixelMeasured);
  measured(10, 5) = measured(11, 5) = 0.0F;
  measured(20, 5) = 0.0F;
  flags(20, 5) = kPixelBody;
  std::array<float, kHalfWidth_px> filled{};
  fill_holes_row(measured, flags, 5, kHalfWidth_px, kHalfHeight_px, filled.data());
  EXPECT_FLOAT_EQ(filled[10], 2.0F);
  EXPECT_FLOAT_EQ(filled[11], 2.0F);
  EXPECT_EQ(filled[20], 0.0F);
  // Nothing is invented in the middle of a large hole.
  for (std::int32_t r = 0; r < 12; ++r) {
    for (std::int32_t c = 30; c < 50; ++c) measured(c, r) = 0.0F;
  }
  fill_holes_row(measured, flags, 5, kHalfWidth_px, kHalfHeight_px, filled.data());
  EXPECT_EQ(filled[40], 0.0F);
}

}  // namespace
}  // namespace polygmap
