// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/connected_components.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/column_scene.hpp"

namespace polygmap {
namespace {

constexpr PlaneId kWall = 1;
constexpr std::int16_t kTop = 200, kBottom = 259;

// One plane 1 m ahead, seen in some columns of the picture; elsewhere nothing is measured.
class ConnectedComponentsTest : public testing::Test {
 protected:
  ConnectedComponentsTest() {
    const CameraIntrinsics intrinsics = test::ColumnScene().intrinsics;
    image_->rays.set(intrinsics);
    image_->column_rays.set(intrinsics);
    image_->columns.inverse_depth.fill(0.0F);
    planes_->count = 1;
    FittedPlane& wall = (*planes_)[kWall];
    wall.plane = test::plane_of(-Vec3::UnitZ(), 1.0);
    wall.kind = SurfaceKind::kRiser;
    wall.alive = true;
    wall.moments.count = 4.0;
    wall.residual2 = 4e-6;
  }
  void show(std::int32_t first_column, std::int32_t last_column, std::int16_t top = kTop,
            std::int16_t bottom = kBottom) {
    for (std::int32_t g = first_column; g <= last_column; ++g) {
      ColumnSpan span;
      span.top = top;
      span.bottom = bottom;
      span.plane = kWall;
      ASSERT_TRUE(boundaries_->columns()[static_cast<std::size_t>(g)].try_push_back(span));
    }
  }
  // What lies in those columns, m.
  void see(std::int32_t first_column, std::int32_t last_column, float depth_m) {
    for (std::int32_t g = first_column; g <= last_column; ++g) {
      for (std::int32_t r = 0; r < kDepthHeight_px; ++r) image_->columns.inverse_depth(g, r) = 1.0F / depth_m;
    }
  }
  void join() {
    const std::int32_t columns = image_->column_rays.columns;
    components_->begin_find();
    for (std::int32_t g = 0; g < columns; ++g) components_->link(boundaries_->columns(), g);
    while (!components_->number_some()) {
    }
    for (std::int32_t g = 0; g < columns; ++g) components_->measure(boundaries_->columns(), g);
    components_->begin_join({}, *boundaries_, *image_, *planes_, *regions_);
    while (!components_->join_some()) {
    }
    EXPECT_EQ(components_->region_overflow(), 0U);
  }
  [[nodiscard]] RegionId region_in(std::int32_t column, std::size_t span = 0) const {
    return components_->region_of(boundaries_->columns()[static_cast<std::size_t>(column)][span].component);
  }

  std::unique_ptr<FrameImage> image_ = std::make_unique<FrameImage>();
  std::unique_ptr<PlaneSet> planes_ = std::make_unique<PlaneSet>();
  std::unique_ptr<SpanBoundaries> boundaries_ = std::make_unique<SpanBoundaries>();
  std::unique_ptr<ConnectedComponents> components_ = std::make_unique<ConnectedComponents>();
  std::unique_ptr<Regions> regions_ = std::make_unique<Regions>();
};

TEST_F(ConnectedComponentsTest, WithNothingMeasuredBetween_AreOneRegion) {
  show(20, 29), show(34, 39);
  join();
  ASSERT_EQ(regions_->count, 1U);
  const Region& region = (*regions_)[kWall];
  EXPECT_TRUE(region.alive);
  EXPECT_EQ(region.source, kWall);
  EXPECT_EQ(region.coplanar, kWall);
  EXPECT_EQ(region.area_px, 16.0 * kColumn_px * (kBottom - kTop + 1));
  EXPECT_NEAR(region.rmse_m, 1e-3, 1e-12);
  EXPECT_EQ(region_in(20), kWall);
  EXPECT_EQ(region_in(39), kWall);
}

TEST_F(ConnectedComponentsTest, WithSomethingFartherBetween_AreTwoRegionsOfThatPlane) {
  show(20, 29), show(34, 39);
  see(30, 33, 1.5F);
  join();
  ASSERT_EQ(regions_->count, 2U);
  EXPECT_EQ(region_in(20), kWall) << "the larger one keeps the plane's number";
  EXPECT_EQ(region_in(39), 2U);
  EXPECT_EQ((*regions_)[2].source, kWall);
  EXPECT_EQ((*regions_)[2].coplanar, kWall) << "the gap is narrower than the smaller one is wide";
  EXPECT_LT((*regions_)[kWall].centre_m.x(), (*regions_)[2].centre_m.x());
}

TEST_F(ConnectedComponentsTest, FartherApartThanTheSmallerOneIsWide_CountAsTwoPlanes) {
  show(10, 29), show(60, 65);
  see(30, 59, 1.5F);
  join();
  ASSERT_EQ(regions_->count, 2U);
  EXPECT_EQ((*regions_)[2].coplanar, 2U);
}

// The floor beside a flight of stairs, in the corners of the picture that the treads leave: 1200 and 1120 pixels.
TEST_F(ConnectedComponentsTest, SmallPiecesOfOnePlaneAtThePicturesEdge_AreRegionsTogether_AndNoneAlone) {
  (*planes_)[kWall].kind = SurfaceKind::kTread;
  show(77, 79, 20, 69), show(78, 79, 300, 369);
  for (std::int32_t g = 70; g < kColumns; ++g) {
    for (std::int32_t r = 70; r < 300; ++r) image_->columns.inverse_depth(g, r) = 1.0F / 0.7F;
  }
  join();
  ASSERT_EQ(regions_->count, 2U);
  EXPECT_TRUE((*regions_)[kWall].alive);
  EXPECT_TRUE((*regions_)[2].alive);
  EXPECT_EQ((*regions_)[2].coplanar, kWall);
  EXPECT_EQ(region_in(77), kWall);
  EXPECT_EQ(region_in(79, 1), 2U);
  for (std::int32_t g = 0; g < kColumns; ++g) boundaries_->columns()[static_cast<std::size_t>(g)].clear();
  show(77, 79, 20, 69);
  join();
  EXPECT_FALSE((*regions_)[kWall].alive);
  EXPECT_EQ(region_in(77), kNoRegion);
}

// Nothing says that two pieces far from each other within the picture are one thing.
TEST_F(ConnectedComponentsTest, SmallPiecesThatCountAsTwoPlanes_AreInNoRegion) {
  show(20, 22, 200, 249), show(60, 61, 200, 269);
  see(23, 59, 1.5F);
  join();
  EXPECT_EQ(region_in(20), kNoRegion);
  EXPECT_EQ(region_in(60), kNoRegion);
}

TEST_F(ConnectedComponentsTest, ThatAreTooSmall_AreInNoRegion) {
  show(20, 29);
  show(40, 41, 100, 108);  // 144 pixels
  join();
  EXPECT_EQ(regions_->count, 1U);
  EXPECT_EQ(region_in(20), kWall);
  EXPECT_EQ(region_in(40), kNoRegion);
}

TEST_F(ConnectedComponentsTest, OfAPlaneThatWasGivenUp_AreInNoRegion) {
  (*planes_)[kWall].alive = false;
  show(20, 29);
  join();
  EXPECT_FALSE((*regions_)[kWall].alive);
  EXPECT_EQ(region_in(20), kNoRegion);
}

TEST_F(ConnectedComponentsTest, SpansThatShareNoRows_DoNotHangTogether) {
  show(20, 29);
  show(30, 39, kBottom + 1, kBottom + 60);
  join();
  const auto component = [&](std::size_t g) { return boundaries_->columns()[g][0].component; };
  EXPECT_EQ(component(20), component(29));
  EXPECT_EQ(component(30), component(39));
  EXPECT_NE(component(29), component(30));
}

}  // namespace
}  // namespace polygmap
