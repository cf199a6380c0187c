// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/thing_map.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "sim_stub/robot_camera.hpp"
#include "tests/support/remembered_stairs.hpp"

namespace polygmap {
namespace {

class ThingMapTest : public ::testing::Test {
 protected:
  const Transform camera_ = test::looking_down({0.0, 0.0, 0.8});
  const CameraIntrinsics intrinsics_ = robot_camera_intrinsics();
  std::unique_ptr<ColumnImage> picture_ = std::make_unique<ColumnImage>();
  std::unique_ptr<ThingMap> map_ = std::make_unique<ThingMap>(ThingMap::Params{});
  OccupiedCells occupied_;

  // A cube of that side, its middle at p, in the map.
  [[nodiscard]] ThingSighting cube_at(const Vec3& p_m, double side_m) const {
    const Transform inverse = camera_.inverse();
    const Vec3 half{0.5 * side_m, 0.0, 0.0};
    return {inverse * Vec3{p_m - half}, inverse * Vec3{p_m + half}, side_m};
  }
  // height_m: of the level ground that the picture shows; above the camera: it shows nothing.
  void frames(int count, const std::vector<ThingSighting>& things, double height_m) {
    const double depth_m = camera_.p_m.z() - height_m;
    picture_->inverse_depth.fill(depth_m > 0.0 ? static_cast<float>(1.0 / depth_m) : 0.0F);
    for (int i = 0; i < count; ++i) {
      map_->begin({camera_, intrinsics_, picture_.get()});
      for (const ThingSighting& thing : things) map_->add(thing);
      for (std::size_t cell = 0; cell < map_->count(); ++cell) map_->look_again(cell);
      map_->finish(occupied_);
    }
  }
};

TEST_F(ThingMapTest, ThingSeenInSomePictures_ItsCellsAreOccupied) {
  const Vec3 p_m{0.1, -0.05, 0.2};
  frames(10, {cube_at(p_m, 0.04)}, 0.2);
  ASSERT_GE(occupied_.size(), 2U);
  for (const OccupiedCell& cell : occupied_) {
    EXPECT_NEAR(cell.x_m, p_m.x(), 0.031);
    EXPECT_NEAR(cell.y_m, p_m.y(), 0.011);
    EXPECT_NEAR(cell.ground_m, 0.2, 1e-9);
    EXPECT_NEAR(cell.height_m, 0.04, 1e-9);
  }
}

TEST_F(ThingMapTest, FlyingPixelsOfTwoPictures_OccupyNothing) {
  frames(2, {cube_at({0.1, -0.05, 0.2}, 0.04)}, 0.2);
  EXPECT_TRUE(occupied_.empty());
  frames(6, {}, 0.2);
  EXPECT_EQ(map_->count(), 0U);
}

TEST_F(ThingMapTest, ThingGone_ItsGroundSeenFree_IsForgotten) {
  frames(10, {cube_at({0.1, -0.05, 0.2}, 0.04)}, 0.2);
  ASSERT_FALSE(occupied_.empty());
  frames(5, {}, 0.2);
  EXPECT_FALSE(occupied_.empty()) << "some pictures without it are no proof";
  frames(30, {}, 0.2);
  EXPECT_TRUE(occupied_.empty());
}

TEST_F(ThingMapTest, ThingHiddenOrOutOfView_IsRemembered) {
  frames(10, {cube_at({0.1, -0.05, 0.2}, 0.04)}, 0.2);
  const std::size_t cells = occupied_.size();
  frames(200, {}, 0.9);  // nothing measured
  EXPECT_EQ(occupied_.size(), cells);
  frames(200, {}, 0.5);  // something nearer
  EXPECT_EQ(occupied_.size(), cells);
}

TEST_F(ThingMapTest, MoreThingsThanThereIsRoomFor_TheFarthestMakesRoom) {
  std::vector<ThingSighting> row;
  for (int i = 0; i < 64; ++i) row.push_back(cube_at({0.6, 0.02 * i - 0.64, 0.2}, 0.03));
  frames(10, row, 0.2);
  EXPECT_LE(map_->count(), kMaxOccupiedCells);
  frames(10, {cube_at({0.05, 0.0, 0.2}, 0.02)}, 0.9);
  EXPECT_TRUE(std::any_of(occupied_.begin(), occupied_.end(),
                          [](const OccupiedCell& cell) { return std::abs(cell.x_m - 0.05) < 0.02; }));
}

}  // namespace
}  // namespace polygmap
