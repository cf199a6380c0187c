// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/convex_outline.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

TEST(ConvexOutlineTest, Clip_SquareByALine_LeavesThePartInside) {
  Outline2 square;
  for (const Vec2& p : {Vec2{0, 0}, Vec2{2, 0}, Vec2{2, 2}, Vec2{0, 2}}) ASSERT_TRUE(square.try_push_back(p));
  clip(square, {0, 0.5}, {0, 1});
  EXPECT_NEAR(0.5 * twice_area(square), 3.0, 1e-12);
  EXPECT_NEAR(centroid(square).y(), 1.25, 1e-12);
  clip(square, {0, 5}, {0, 1});
  EXPECT_TRUE(square.empty());
}

}  // namespace
}  // namespace polygmap
