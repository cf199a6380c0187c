// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/side_lines.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/column_scene.hpp"

namespace polygmap {
namespace {

constexpr RegionId kNear = 1, kFar = 2;
constexpr std::int32_t kTop = 100, kBottom = 299;

// A board across the picture's axis, 1 m away, before a wall at 1.3 m, between two straight sides.
class SideLinesTest : public testing::Test {
 protected:
  struct Side {  // column = at + slope * row, full-resolution pixels
    double at, slope;
  };
  SideLinesTest() {
    intrinsics_ = test::ColumnScene().intrinsics;
    picture_->rays.set(intrinsics_);
    picture_->column_rays.set(intrinsics_);
    picture_->flags.fill(0);
    raw_.depth = depth_->data();
    raw_.intrinsics = intrinsics_;
    raw_.range.set({}, intrinsics_.depth_unit_m);
    regions_->count = 2;
    (*regions_)[kNear].plane = test::plane_of(-Vec3::UnitZ(), 1.0);
    (*regions_)[kFar].plane = test::plane_of(-Vec3::UnitZ(), 1.3);
  }
  void own(std::int32_t g, std::int32_t r) {
    regions_->labels.at(g, r) = kNear;
    regions_->extents[kNear].add(g, static_cast<std::int16_t>(r), static_cast<std::int16_t>(r));
  }
  // beyond_mm: what is seen past the board; its columns are labelled so.
  void paint(Side left, Side right, std::uint16_t beyond_mm, RegionId label) {
    regions_->extents[kNear] = ColumnExtents{};
    double pixels = 0.0;
    for (std::int32_t r = 0; r < intrinsics_.height_px; ++r) {
      const double first = left.at + left.slope * r, past = right.at + right.slope * r;
      for (std::int32_t c = 0; c < intrinsics_.width_px; ++c) {
        const bool inside = r >= kTop && r <= kBottom && c >= first && c < past;
        (*depth_)(c, r) = inside ? std::uint16_t{1000} : beyond_mm;
        pixels += inside ? 1.0 : 0.0;
      }
      for (std::int32_t g = 0; g < picture_->column_rays.columns; ++g) {
        const double middle = kColumn_px * g + 0.5 * (kColumn_px - 1);
        const bool inside = r >= kTop && r <= kBottom && middle >= first && middle < past;
        regions_->labels.at(g, r) = label;
        if (inside) own(g, r);
      }
    }
    (*regions_)[kNear].area_px = pixels;
  }
  [[nodiscard]] OutlineSide find(bool right) {
    sides_->begin({}, {}, raw_, *picture_, *regions_);
    sides_->find_ends(kNear);
    return sides_->find(kNear, right);
  }
  // The border between pixels c - 1 and c is at c - 0.5; half-resolution pixel i is where 2 i + 0.5 is.
  static void expect_on(const OutlineSide& found, Side truth) {
    ASSERT_TRUE(found.fitted);
    for (const double row : {0.5 * kTop, 0.5 * kBottom}) {
      // Of whole pixels; over many rows that rounding is nothing in the mean.
      EXPECT_NEAR(2.0 * found.at(row) + 0.5, truth.at + truth.slope * (2.0 * row + 0.5), 0.3) << row;
    }
    EXPECT_NEAR(found.top_px, 0.5 * kTop, 6.0);
    EXPECT_NEAR(found.bottom_px, 0.5 * kBottom, 6.0);
  }

  CameraIntrinsics intrinsics_;
  using Depth = Raster<std::uint16_t, kDepthWidth_px, kDepthHeight_px>;
  std::unique_ptr<Depth> depth_ = std::make_unique<Depth>();
  std::unique_ptr<FrameImage> picture_ = std::make_unique<FrameImage>();
  std::unique_ptr<Regions> regions_ = std::make_unique<Regions>();
  std::unique_ptr<SideLines> sides_ = std::make_unique<SideLines>();
  RawImage raw_;
  static constexpr Side kLeft{150.3, -0.11}, kRight{402.7, 0.17};
};

TEST_F(SideLinesTest, StraightSides_AreFoundWhetherOrNotThePlaneBeyondIsKnown) {
  for (const RegionId beyond : {kNoRegion, kFar}) {
    paint(kLeft, kRight, 1300, beyond);
    expect_on(find(false), kLeft);
    expect_on(find(true), kRight);
  }
}

TEST_F(SideLinesTest, WallCloseBehind_EndsTheBoardOnlyWhereItIsKnown) {
  // 4 mm are 1.6 sigmas: nothing that has left the board, but another plane if there is one.
  (*regions_)[kFar].plane = test::plane_of(-Vec3::UnitZ(), 1.004);
  paint(kLeft, kRight, 1004, kFar);
  expect_on(find(true), kRight);
  paint(kLeft, kRight, 1004, 0);
  EXPECT_FALSE(find(true).fitted);
}

TEST_F(SideLinesTest, LastTwoPixelsOfThePicture_AreTooFewToEndABoard) {
  paint({1.5, 0.0}, {638.0, 0.0}, 1300, 0);
  EXPECT_FALSE(find(false).fitted);
  EXPECT_FALSE(find(true).fitted);
}

TEST_F(SideLinesTest, PictureEnd_IsNoSide) {
  paint({-10.0, 0.0}, {650.0, 0.0}, 1300, 0);
  const OutlineSide left = find(false), right = find(true);
  EXPECT_FALSE(left.fitted);
  EXPECT_FALSE(right.fitted);
  // As far as the columns reach: the outer borders of pixels 0 and 639.
  EXPECT_NEAR(2.0 * left.column_px + 0.5, -0.5, 1e-9);
  EXPECT_NEAR(2.0 * right.column_px + 0.5, 639.5, 1e-9);
}

TEST_F(SideLinesTest, NothingMeasuredBeyond_IsNoSide) {
  paint(kLeft, kRight, 0, 0);
  EXPECT_FALSE(find(false).fitted);
  EXPECT_FALSE(find(true).fitted);
}

TEST_F(SideLinesTest, OwnBodyBesideTheBoard_HidesThatSideOnly) {
  paint(kLeft, kRight, 1300, kFar);
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    const auto past = static_cast<std::int32_t>(0.5 * (kRight.at + kRight.slope * 2.0 * r));
    for (std::int32_t c = past - 2; c < past + 20; ++c) picture_->flags(c, r) = kPixelBody;
    picture_->body_rows[static_cast<std::size_t>(r)] = true;
  }
  EXPECT_FALSE(find(true).fitted);
  expect_on(find(false), kLeft);
}

TEST_F(SideLinesTest, EndThatLeansMoreThanItRises_IsAFrontAndNoSide) {
  paint(kLeft, {200.0, 1.4}, 1300, kFar);
  EXPECT_FALSE(find(true).fitted);
  paint(kLeft, {300.0, 0.7}, 1300, kFar);
  expect_on(find(true), {300.0, 0.7});
}

TEST_F(SideLinesTest, CrookedEnd_IsNotCutStraight) {
  // A corner sticks out of the lower half: a line through the upper half's end would cut it off.
  paint(kLeft, {400.0, 0.0}, 1300, kFar);
  for (std::int32_t r = (kTop + kBottom) / 2 + 8; r <= kBottom; ++r) {
    for (std::int32_t c = 400; c < 480; ++c) (*depth_)(c, r) = 1000;
    for (std::int32_t g = 400 / kColumn_px; g < 480 / kColumn_px; ++g) own(g, r);
  }
  EXPECT_FALSE(find(true).fitted);
  EXPECT_NEAR(2.0 * find(true).column_px + 0.5, 479.5, 1.0);
}

// To the instruction: less is seldom seen in the units.
TEST_F(SideLinesTest, EndsOfRows_ArePaidForWhateverTheRegistersWidth) {
  regions_->extents[kNear] = ColumnExtents{};
  for (std::int32_t g = 20; g < 24; ++g) {
    for (std::int32_t r = 120; r <= 200; ++r) own(g, r);
  }
  sides_->begin({}, {}, raw_, *picture_, *regions_);
  sides_->find_ends(kNear);
  // Rows from 96 on are cleared; four columns of 81 rows are looked at.
  EXPECT_EQ(sides_->work().instructions(), 260 + (200 - 96) / 8 + 4 * 30 + 11 * 4 * (80 + 32) / 16);
}

}  // namespace
}  // namespace polygmap
