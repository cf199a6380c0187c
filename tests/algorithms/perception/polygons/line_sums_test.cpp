// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/line_sums.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

TEST(LineSums, PointsOfALine_AnyWeights_GiveTheLine) {
  LineSums<double> sums{};
  for (int i = 0; i < 9; ++i) sums.add(1.0 + i % 3, 100.0 + i, 3.0 - 0.5 * (100.0 + i));
  double a = 0.0, b = 0.0;
  ASSERT_TRUE(try_solve(sums, a, b));
  EXPECT_NEAR(a, 3.0, 1e-9);
  EXPECT_NEAR(b, -0.5, 1e-11);
}

TEST(LineSums, HeavierPoints_DrawTheLineMore) {
  LineSums<double> sums{};
  for (int i = 0; i < 4; ++i) {
    sums.add(3.0, i, 0.0);
    sums.add(1.0, i, 1.0);
  }
  double a = 0.0, b = 1.0;
  ASSERT_TRUE(try_solve(sums, a, b));
  EXPECT_NEAR(a, 0.25, 1e-12);
  EXPECT_NEAR(b, 0.0, 1e-12);
}

TEST(LineSums, NoPointsOrAllAtOneX_AreRefused) {
  double a = 7.0, b = 8.0;
  LineSums<double> sums{};
  EXPECT_FALSE(try_solve(sums, a, b));
  for (int i = 0; i < 5; ++i) sums.add(1.0, 40.0, i);
  EXPECT_FALSE(try_solve(sums, a, b));
  EXPECT_EQ(a, 7.0);
  EXPECT_EQ(b, 8.0);
}

}  // namespace
}  // namespace polygmap
