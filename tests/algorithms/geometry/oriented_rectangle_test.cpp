// SPDX-License-Identifier: Apache-2.0
#include "algorithms/geometry/oriented_rectangle.hpp"

#include <gtest/gtest.h>

#include <random>

namespace polygmap {
namespace {

TEST(OrientedRectangleEq34, RandomRectangles_AgreesWithSampledPoints) {
  std::mt19937 random(7);
  std::uniform_real_distribution<> place(-0.3, 0.3), angle(-kPi, kPi);
  int together = 0, apart = 0;
  for (int i = 0; i < 1500; ++i) {
    const OrientedRectangle a{{place(random), place(random)}, 0.13, 0.048, angle(random)};
    const OrientedRectangle b{{place(random), place(random)}, 0.13, 0.048, angle(random)};
    const auto depth_in_b = [&](const Vec2& p) {  // how deep a point is inside b
      const Vec2 d = p - b.centre_m;
      const double along = math::cos(b.yaw_rad) * d.x() + math::sin(b.yaw_rad) * d.y();
      const double across = -math::sin(b.yaw_rad) * d.x() + math::cos(b.yaw_rad) * d.y();
      return std::min(b.half_length_m - std::abs(along), b.half_width_m - std::abs(across));
    };
    double deepest = -1.0;
    for (int u = -20; u <= 20; ++u) {
      for (int v = -20; v <= 20; ++v) {
        const double x = u / 20.0 * a.half_length_m, y = v / 20.0 * a.half_width_m;
        const Vec2 heading{math::cos(a.yaw_rad), math::sin(a.yaw_rad)};
        deepest = std::max(deepest, depth_in_b(a.centre_m + x * heading + y * Vec2{-heading.y(), heading.x()}));
      }
    }
    if (std::abs(deepest) < 0.01) continue;  // too close to call for a grid
    EXPECT_EQ(overlap(a, b), deepest > 0.0) << i;
    EXPECT_EQ(overlap(a, b), overlap(b, a)) << i;
    (deepest > 0.0 ? together : apart)++;
  }
  EXPECT_GT(together, 150);
  EXPECT_GT(apart, 150);
}

}  // namespace
}  // namespace polygmap
