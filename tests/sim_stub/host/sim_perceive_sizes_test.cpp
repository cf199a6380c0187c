// SPDX-License-Identifier: Apache-2.0
// Pictures of any size, through the module's own extractor and through the one for larger pictures.
#include <gtest/gtest.h>

#include <utility>

#include "sim_stub/host/perceive/perceive.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap::sim {
namespace {

struct Size {
  std::int32_t width_px, height_px;
};

// Stairs as the robot's camera sees them, with as many pixels as that.
test::DepthScene stairs_of(Size size) {
  test::DepthScene scene;
  const double scale = std::min(size.width_px / 640.0, size.height_px / 480.0);
  scene.intrinsics = {size.width_px,
                      size.height_px,
                      366.7 * scale,
                      366.7 * scale,
                      0.5 * (size.width_px - 1),
                      0.5 * (size.height_px - 1),
                      0.001};
  scene.place_camera(0.77, 1.047, 0.05, 0.01);
  return scene;
}

config::CameraProfile profile_of(const test::DepthScene& scene) {
  config::CameraProfile profile;
  profile.intrinsics = scene.intrinsics;
  return profile;
}

DepthPng png_of(const test::DepthPicture& picture) {
  return {picture.intrinsics.width_px, picture.intrinsics.height_px, picture.raw()};
}

class PerceiveSizes : public testing::TestWithParam<Size> {};

TEST_P(PerceiveSizes, Stairs_AreFoundAndEveryLabelLiesOnItsPlane) {
  const Size size = GetParam();
  test::DepthScene scene = stairs_of(size);
  const test::StairSpec stairs;
  scene.add_stairs(stairs);
  test::DepthPicture picture = test::render(scene);
  const std::vector<double> truth_m = picture.depth_m;
  test::add_noise(picture, {}, 5);
  const Perceived found = perceive(profile_of(scene), png_of(picture), -scene.camera_up(), 1);

  for (int k = 1; k <= 2; ++k) {
    const double front_m = stairs.first_riser_x_m + (k - 1) * stairs.tread_m;
    int treads = 0, risers = 0;
    for (const PerceivedPlane& pieces : found.planes) {
      const Surface& s = pieces.front();
      const Vec3 centroid = scene.world_T_camera * s.centroid_m;
      if (s.kind == polygmap_frames::Kind::kRiser && std::abs(centroid.x() - front_m) < 0.01) ++risers;
      if (s.kind != polygmap_frames::Kind::kTread || std::abs(centroid.z() - k * stairs.rise_m) > 0.01) continue;
      ++treads;
      ASSERT_TRUE(s.nosing_m.has_value());
      for (const Vec3& end : *s.nosing_m) EXPECT_NEAR((scene.world_T_camera * end).x(), front_m, 0.0025) << k;
    }
    EXPECT_EQ(treads, 1) << k;
    EXPECT_EQ(risers, 1) << k;
  }

  ASSERT_EQ(found.labels.size(), truth_m.size());
  int measured = 0, labelled = 0, right = 0;
  for (std::int32_t r = 0, i = 0; r < size.height_px; ++r) {
    for (std::int32_t c = 0; c < size.width_px; ++c, ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (picture.depth_m[at] == 0.0) continue;
      ++measured;
      if (found.labels[at] == 0) continue;
      ++labelled;
      const Surface& s = found.planes[found.labels[at] - 1U].front();
      const CameraIntrinsics& k = scene.intrinsics;
      const Vec3 point = truth_m[at] * Vec3{(c - k.cx_px) / k.fx_px, (r - k.cy_px) / k.fy_px, 1.0};
      right += std::abs(s.normal.dot(point) + s.d_m) < 0.005 ? 1 : 0;
    }
  }
  EXPECT_GT(labelled, 0.95 * measured);
  EXPECT_GT(right, 0.98 * labelled);
}

INSTANTIATE_TEST_SUITE_P(Sizes, PerceiveSizes,
                         testing::Values(Size{1024, 768}, Size{1023, 767}, Size{1024, 240}, Size{848, 480},
                                         Size{512, 424}, Size{641, 479}, Size{240, 768}, Size{322, 241}),
                         [](const testing::TestParamInfo<Size>& size) {
                           return std::to_string(size.param.width_px) + "x" + std::to_string(size.param.height_px);
                         });

TEST(PerceiveSize, ThirtyThreeByThirtyTwo_ShowsTheFloorAndNothingElse) {
  const test::DepthScene scene = stairs_of({33, 32});
  const Perceived found = perceive(profile_of(scene), png_of(test::render(scene)), -scene.camera_up(), 1);
  ASSERT_EQ(found.planes.size(), 1U);
  const Surface& floor = found.planes[0].front();
  EXPECT_EQ(floor.kind, polygmap_frames::Kind::kTread);
  EXPECT_NEAR(floor.d_m, 0.77, 0.001);
  EXPECT_GT(floor.normal.dot(scene.camera_up()), 0.9999);
  ASSERT_EQ(found.labels.size(), 33U * 32U);
  // The odd column is not looked at.
  for (std::size_t i = 0; i < found.labels.size(); ++i) EXPECT_EQ(found.labels[i], i % 33 < 32 ? 1 : 0) << i;
}

polygmap_frames::Camera camera_of(const CameraIntrinsics& k, const DepthNoiseModel& noise) {
  return {k.width_px,
          k.height_px,
          k.fx_px,
          k.fy_px,
          k.cx_px,
          k.cy_px,
          k.depth_unit_m,
          0.2,
          4.0,
          noise.base_m,
          noise.per_metre,
          noise.quadratic_per_m,
          noise.correlated_share,
          noise.correlated_px};
}

// Capacities apart, the two are one extractor.
TEST(PerceiveSize, BothExtractors_SayTheSameOfAPictureThatBothHold) {
  test::DepthScene scene = stairs_of({640, 480});
  scene.add_stairs({});
  test::DepthPicture picture = test::render(scene);
  test::add_noise(picture, {.correlated = true}, 6);
  const std::vector<std::uint16_t> raw = picture.raw();
  const polygmap_frames::Camera camera = camera_of(scene.intrinsics, DepthNoiseModel{});
  EXPECT_TRUE(holds(camera));
  const auto own = make_extractor(camera, {}), large = polygmap_1024x768::make_extractor(camera, {});
  ASSERT_TRUE(own->extract(raw.data(), scene.camera_up()) && large->extract(raw.data(), scene.camera_up()));
  const std::vector<Surface> a = own->surfaces(), b = large->surfaces();
  EXPECT_EQ(own->noise_sigma_m(1.0), large->noise_sigma_m(1.0));
  EXPECT_EQ(own->noise_sigma_m(3.0), large->noise_sigma_m(3.0));
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GE(a.size(), 5U);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].normal, b[i].normal);
    EXPECT_EQ(a[i].d_m, b[i].d_m);
    EXPECT_EQ(a[i].polygon_m, b[i].polygon_m);
    EXPECT_EQ(a[i].nosing_m, b[i].nosing_m);
    EXPECT_EQ(a[i].rmse_m, b[i].rmse_m);
    EXPECT_EQ(a[i].invalid_fraction, b[i].invalid_fraction);
  }
  for (std::int32_t r = 0; r < camera.height_px; ++r) {
    for (std::int32_t c = 0; c < camera.width_px; ++c) ASSERT_EQ(own->surface_at(c, r), large->surface_at(c, r));
  }
}

TEST(PerceiveNoise, MoreThanThePictureShows_IsHalvedAtMostAndNeverBelowTheUsual) {
  constexpr int kPictures = 20;
  test::DepthScene scene = stairs_of({640, 480});
  scene.add_stairs({});
  test::DepthPicture picture = test::render(scene);
  test::add_noise(picture, {.strength = 0.1}, 6);
  const std::vector<std::uint16_t> raw = picture.raw();
  const DepthNoiseModel usual;
  for (const auto& [said, believed] : {std::pair{1.0, 1.0}, std::pair{1.5, 1.0}, std::pair{3.0, 1.5}}) {
    const auto extractor = make_extractor(camera_of(scene.intrinsics, usual.scaled(said)), {});
    for (int i = 0; i < kPictures; ++i) ASSERT_TRUE(extractor->extract(raw.data(), scene.camera_up()));
    EXPECT_NEAR(extractor->noise_sigma_m(1.0) / usual.sigma_m(1.0), believed, 0.02) << said;
  }
}

TEST(PerceiveSize, LargerThanTheModulesPictures_OnlyTheLargerExtractorTakes) {
  polygmap_frames::Camera camera;
  camera.width_px = 644;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 400.0;
  camera.depth_unit_m = 0.001;
  camera.max_depth_m = 4.0;
  EXPECT_FALSE(holds(camera));
  const std::vector<std::uint16_t> raw(644 * 480, 1000);
  EXPECT_FALSE(make_extractor(camera, {})->extract(raw.data(), -Vec3::UnitY()));
  EXPECT_TRUE(polygmap_1024x768::make_extractor(camera, {})->extract(raw.data(), -Vec3::UnitY()));
}

}  // namespace
}  // namespace polygmap::sim
