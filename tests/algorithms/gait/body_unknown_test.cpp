// SPDX-License-Identifier: Apache-2.0
// What the robot's own body hides is unknown, not free: from the mask through the surfaces to the map.
#include <gtest/gtest.h>

#include <memory>

#include "algorithms/perception/map/polygon_map.hpp"
#include "algorithms/perception/surface_extractor.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap {
namespace {

constexpr test::StairSpec kStairs{.first_riser_x_m = 0.3, .width_m = 0.8};

class BodyInView : public testing::Test {
 protected:
  BodyInView() {
    scene_.intrinsics = robot_camera_intrinsics();
    scene_.place_camera(0.77, 1.047);
    scene_.add_stairs(kStairs);
  }
  // The same picture, frame after frame.
  void look(int frames) {
    test::DepthPicture picture = test::render(scene_);
    test::add_noise(picture, {}, 5);
    const std::vector<std::uint16_t> raw = picture.raw();
    for (int i = 0; i < frames; ++i) {
      stamp_ns_ += 33 * kNsPerMs;
      SurfaceExtractor::View view;
      view.intrinsics = scene_.intrinsics;
      view.camera_up = scene_.camera_up();
      view.body = scene_.legs;
      ASSERT_TRUE(extractor_->try_begin({stamp_ns_, 1, 640, 480, raw.data()}, view));
      WorkBudget budget(1'000'000);
      ASSERT_EQ(extractor_->step(budget), Progress::kDone);
      PolygonMap::View seen;
      seen.odom_T_camera = scene_.world_T_camera;
      seen.position_sigma_m = 0.002;
      seen.tilt_sigma_rad = 0.002;
      seen.intrinsics = scene_.intrinsics;
      seen.body = scene_.legs;
      map_->begin(extractor_->result(), seen);
      WorkBudget more(1'000'000);
      ASSERT_EQ(map_->step(more), Progress::kDone);
    }
  }
  [[nodiscard]] const SurfacePatch* first_tread() const {
    const SurfacePatch* found = nullptr;
    for (const MapPolygon& polygon : map_->snapshot().polygons) {
      const SurfacePatch& s = polygon.surface;
      if (s.kind == SurfaceKind::kTread && std::abs(s.centroid_m.z() - kStairs.rise_m) < 0.02) found = &s;
    }
    return found;
  }
  // Least and greatest world coordinate of the first tread.
  [[nodiscard]] std::pair<Vec3, Vec3> extent() const {
    std::pair<Vec3, Vec3> e{Vec3::Constant(1e9), Vec3::Constant(-1e9)};
    const SurfacePatch* tread = first_tread();
    if (tread == nullptr) return e;
    for (const Vec3& v : tread->polygon) e = {e.first.cwiseMin(v), e.second.cwiseMax(v)};
    return e;
  }
  // An upright shank between the camera and the ground.
  void hold_a_leg_over(double y_m, double radius_m) {
    const Transform camera_T_world = scene_.world_T_camera.inverse();
    scene_.legs[0].shank = {camera_T_world * Vec3{0.25, y_m, 0.45}, camera_T_world * Vec3{0.45, y_m, 0.30}, radius_m};
  }

  test::DepthScene scene_;
  std::unique_ptr<SurfaceExtractor> extractor_ = std::make_unique<SurfaceExtractor>();
  std::unique_ptr<PolygonMap> map_ = std::make_unique<PolygonMap>();
  std::int64_t stamp_ns_ = 0;
};

TEST_F(BodyInView, EndOfATreadBehindALeg_IsUnknownAndPullsNothingInwards) {
  look(20);
  ASSERT_NE(first_tread(), nullptr);
  const auto [low, high] = extent();
  EXPECT_NEAR(low.y(), -0.4, 0.01);
  hold_a_leg_over(-0.25, 0.12);
  look(1);
  // This frame's own polygon ends at the leg, and does not claim that the tread does.
  bool ends_at_the_leg = false;
  for (const SurfacePatch& s : extractor_->result().surfaces) {
    if (s.kind != SurfaceKind::kTread || std::abs((scene_.world_T_camera * s.centroid_m).z() - kStairs.rise_m) > 0.02) {
      continue;
    }
    for (std::size_t i = 0; i < s.polygon.size(); ++i) {
      const Vec3 a = scene_.world_T_camera * s.polygon[i],
                 b = scene_.world_T_camera * s.polygon[(i + 1) % s.polygon.size()];
      if (std::max(a.y(), b.y()) > 0.2 || std::abs(a.x() - b.x()) < 0.1) continue;  // the right end alone
      EXPECT_EQ(s.edges[i], EdgeKind::kUnknown);
      EXPECT_GT(std::min(a.y(), b.y()), -0.38);
      ends_at_the_leg = true;
    }
  }
  EXPECT_TRUE(ends_at_the_leg);
  look(120);
  const auto [low_after, high_after] = extent();
  EXPECT_NEAR(low_after.y(), low.y(), 0.003);
  EXPECT_NEAR(high_after.y(), high.y(), 0.003);
  EXPECT_NEAR(low_after.x(), low.x(), 0.003);
}

TEST_F(BodyInView, TreadBehindTheBody_IsNotSeenEmpty) {
  look(20);
  ASSERT_NE(first_tread(), nullptr);
  hold_a_leg_over(0.0, 0.18);
  scene_.legs[0].thigh = scene_.legs[1].shank = scene_.legs[1].thigh = scene_.legs[0].shank;
  const Transform camera_T_world = scene_.world_T_camera.inverse();
  for (const double y : {-0.35, 0.35}) {
    Capsule& beside = scene_.legs[y > 0 ? 0 : 1].thigh;
    beside = {camera_T_world * Vec3{0.25, y, 0.45}, camera_T_world * Vec3{0.45, y, 0.30}, 0.2};
  }
  look(200);  // a confirmed surface that is in view and not there is gone after 90
  EXPECT_NE(first_tread(), nullptr);
  EXPECT_EQ(map_->counters().dropped_vanished, 0U);
  // Without a body the same view without the stairs says that they are gone.
  scene_.legs = {};
  scene_.boxes.clear();
  look(120);
  EXPECT_EQ(first_tread(), nullptr);
}

}  // namespace
}  // namespace polygmap
