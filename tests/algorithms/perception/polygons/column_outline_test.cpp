// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/column_outline.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

constexpr double kCorner_px = 4.0;

ColumnExtents rectangle(std::int32_t first, std::int32_t last, std::int16_t top, std::int16_t bottom) {
  ColumnExtents profile;
  for (std::int32_t g = first; g <= last; ++g) profile.add(g, top, bottom);
  return profile;
}

// As far as columns first .. last reach.
OutlineSides upright_sides(std::int32_t first, std::int32_t last) {
  OutlineSides sides;
  sides.left.column_px = 0.5 * kColumn_px * first - 0.5;
  sides.right.column_px = 0.5 * kColumn_px * (last + 1) - 0.5;
  return sides;
}

TEST(ColumnOutline, Rectangle_HasFourCornersInTheOrderOfThePicture) {
  ColumnOutline builder;
  Outline2 outline;
  builder.build(rectangle(10, 20, 100, 199), upright_sides(10, 20), kCorner_px, 20, outline);
  ASSERT_EQ(outline.size(), 4U);
  EXPECT_NEAR(twice_area(outline), 2.0 * 44.0 * 50.0, 1e-9);  // y down: right-hand turns count as positive
  for (const Vec2& p : outline) {
    EXPECT_TRUE(std::abs(p.x() - 39.5) < 1e-9 || std::abs(p.x() - 83.5) < 1e-9);
    EXPECT_TRUE(std::abs(p.y() - 49.5) < 1e-9 || std::abs(p.y() - 99.5) < 1e-9);
  }
}

TEST(ColumnOutline, OneColumnThatRunsOver_DoesNotCarryTheHullAlong) {
  ColumnExtents profile = rectangle(10, 40, 100, 199);
  profile.columns[25].add(60, 230);
  ColumnOutline builder;
  Outline2 outline;
  builder.build(profile, upright_sides(10, 40), kCorner_px, 20, outline);
  for (const Vec2& p : outline) EXPECT_TRUE(p.y() > 49.0 && p.y() < 100.0);
}

TEST(ColumnOutline, FittedSides_CutWhatReachesBeyondAndCloseWhatFallsShort) {
  // A trapezoid whose columns were a little too many on the left and too few on the right.
  OutlineSides sides;
  sides.left = {25.0, 0.1, 49.5, 99.5, true};
  sides.right = {90.0, -0.05, 49.5, 99.5, true};
  ColumnOutline builder;
  Outline2 outline;
  builder.build(rectangle(6, 20, 100, 199), sides, kCorner_px, 20, outline);
  ASSERT_EQ(outline.size(), 4U);
  for (const Vec2& p : outline) {
    EXPECT_LT(std::min(std::abs(p.x() - sides.left.at(p.y())), std::abs(p.x() - sides.right.at(p.y()))), 1e-9);
    EXPECT_TRUE(std::abs(p.y() - 49.5) < 1e-9 || std::abs(p.y() - 99.5) < 1e-9);
  }
}

TEST(ColumnOutline, SideSeenInItsLowerHalfOnly_IsNotExtendedUpwards) {
  ColumnExtents profile = rectangle(10, 40, 100, 199);
  for (std::int32_t g = 10; g < 20; ++g) profile.columns[static_cast<std::size_t>(g)].top = 150;
  OutlineSides sides = upright_sides(10, 40);
  sides.left = {39.0, 0.0, 74.5, 99.5, true};
  ColumnOutline builder;
  Outline2 outline;
  builder.build(profile, sides, kCorner_px, 20, outline);
  double top = 1e9;
  for (const Vec2& p : outline) {
    EXPECT_GE(p.x(), 39.0 - 1e-9);
    if (p.x() < 60.0) top = std::min(top, p.y());
  }
  EXPECT_GT(top, 60.0);
}

TEST(ColumnOutline, NoColumn_NoOutline) {
  ColumnOutline builder;
  Outline2 outline;
  builder.build(ColumnExtents{}, {}, kCorner_px, 20, outline);
  EXPECT_TRUE(outline.empty());
}

TEST(ColumnOutline, RoundSurface_KeepsToItsVerticesAndInside) {
  ColumnExtents profile;
  for (std::int32_t g = 0; g < 50; ++g) {
    const double half = 100.0 * std::sqrt(std::max(0.0, 1.0 - math::square((g - 24.5) / 25.0)));
    profile.add(g, static_cast<std::int16_t>(240.0 - half), static_cast<std::int16_t>(240.0 + half));
  }
  ColumnOutline builder;
  Outline2 outline;
  builder.build(profile, upright_sides(0, 49), kCorner_px, 12, outline);
  EXPECT_LE(outline.size(), 12U);
  EXPECT_GT(0.5 * twice_area(outline), 0.85 * kPi * 100.0 * 50.0);
  EXPECT_LT(0.5 * twice_area(outline), 1.05 * kPi * 100.0 * 50.0);
}

}  // namespace
}  // namespace polygmap
