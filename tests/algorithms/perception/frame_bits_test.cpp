// SPDX-License-Identifier: Apache-2.0
// One picture gives one result, bit for bit, whatever the compiler, its optimisation and the registers' width: AVX2,
// SSE2 (tests/consumer) and NEON (orin). What is recorded here is what every build must give.
#include <gtest/gtest.h>

#include <memory>

#include "algorithms/perception/surface_extractor.hpp"
#include "tests/support/bit_hash.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap {
namespace {

using test::BitHash;

// The robot's camera over stairs with overhanging nosings, a bar known to be the robot's own in front of them.
test::DepthScene scene() {
  test::DepthScene scene;
  scene.intrinsics = {640, 480, 366.7, 366.8, 322.7, 242.3, 0.00025};
  scene.place_camera(0.77, 1.047, 0.07, 0.01);
  scene.add_stairs({.width_m = 0.9, .nosing_m = 0.02});
  const Transform camera_T_world = scene.world_T_camera.inverse();
  scene.legs[0].shank = {camera_T_world * Vec3{0.25, 0.0, 0.5}, camera_T_world * Vec3{0.55, 0.0, 0.1}, 0.05};
  return scene;
}

TEST(FrameBits, TwoPicturesOfStairs_GiveTheRecordedBits) {
  const test::DepthScene scene = polygmap::scene();
  const auto extractor = std::make_unique<SurfaceExtractor>();
  SurfaceExtractor::View view;
  view.intrinsics = scene.intrinsics;
  view.camera_up = scene.camera_up();
  view.body = scene.legs;
  BitHash pictures, surfaces, labels;
  for (const bool correlated : {false, true}) {
    test::DepthPicture picture = test::render(scene);
    test::add_noise(picture, {.correlated = correlated, .strength = 1.5}, 20);
    const std::vector<std::uint16_t> raw = picture.raw();
    for (const std::uint16_t z : raw) pictures.add(std::uint64_t{z});
    ASSERT_TRUE(extractor->try_begin({correlated ? 2 : 1, 1, 640, 480, raw.data()}, view));
    WorkBudget budget(1'000'000);
    ASSERT_EQ(extractor->step(budget), Progress::kDone);
    const SurfaceFrame& frame = extractor->result();
    ASSERT_GE(frame.surfaces.size(), 5U);
    for (const SurfacePatch& s : frame.surfaces) surfaces.add(s);
    surfaces.add(frame.invalid_fraction), surfaces.add(extractor->noise().sigma_m(1.0)),
        surfaces.add(extractor->noise().sigma_m(3.0));
    for (std::int32_t r = 0; r < 480; ++r) {
      for (std::int32_t c = 0; c < 640; ++c) labels.add(std::uint64_t{extractor->surface_at(c, r)});
    }
  }
  ASSERT_EQ(pictures.value(), 17846030271540298326U) << "the scene itself differs: nothing is said of the extraction";
  // Recorded anew when the extraction changes on purpose, and then the same in presets release, asan and orin.
  EXPECT_EQ(labels.value(), 13817851739132871371U);
  EXPECT_EQ(surfaces.value(), 5346281912612266774U);
}

}  // namespace
}  // namespace polygmap
