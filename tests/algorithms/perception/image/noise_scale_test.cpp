// SPDX-License-Identifier: Apache-2.0
// The extractor measures how noisy its pictures are against the camera's profile.
#include <gtest/gtest.h>

#include <memory>
#include <set>

#include "algorithms/perception/surface_extractor.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap {
namespace {

constexpr double kDepth_m = 1.0;

struct Seen {
  double scale = 0.0;  // of the noise at that depth
  int treads = 0, planes = 0;
};

// After some frames of one picture, with noise of so many times the profile's.
Seen look(double strength, double gain, int frames, double min_noise_scale = 1.0) {
  test::DepthScene scene;
  scene.intrinsics = robot_camera_intrinsics();
  scene.place_camera(0.77, 1.047, 0.0, 0.01);
  scene.add_stairs({});
  test::DepthPicture picture = test::render(scene);
  test::add_noise(picture, {.correlated = true, .strength = strength}, 4);
  const std::vector<std::uint16_t> raw = picture.raw();
  SurfaceExtractor::Params params;
  params.depth_noise.gain = gain;
  params.depth_noise.min_scale = min_noise_scale;
  const auto extractor = std::make_unique<SurfaceExtractor>(params);
  SurfaceExtractor::View view;
  view.intrinsics = scene.intrinsics;
  view.camera_up = scene.camera_up();
  for (int i = 0; i < frames; ++i) {
    EXPECT_TRUE(extractor->try_begin({i + 1, 1, 640, 480, raw.data()}, view));
    WorkBudget budget(1'000'000);
    EXPECT_EQ(extractor->step(budget), Progress::kDone);
  }
  Seen seen{extractor->noise().sigma_m(kDepth_m) / DepthNoiseModel{}.sigma_m(kDepth_m)};
  std::set<int> planes;
  for (const SurfacePatch& s : extractor->result().surfaces) {
    planes.insert(s.plane);
    seen.treads += s.kind == SurfaceKind::kTread ? 1 : 0;
  }
  seen.planes = static_cast<int>(planes.size());
  return seen;
}

// Without the lower bound, which is 1 and would hide it, what is measured is the noise of the picture.
TEST(NoiseScale, NoiseAsTheProfileSaysOrLess_IsMeasured) {
  const double as_profile = look(1.0, 0.1, 30, 0.1).scale, third = look(0.33, 0.1, 60, 0.1).scale;
  EXPECT_NEAR(as_profile, 1.3, 0.3);
  EXPECT_NEAR(third / as_profile, 0.33, 0.05);
}

TEST(NoiseScale, NoiseOfTwoAndAHalfTimesTheProfile_IsFoundSlowlyAndPlanesStayWhole) {
  const Seen once = look(2.5, 0.1, 1), blind = look(2.5, 0.0, 40), settled = look(2.5, 0.1, 40);
  EXPECT_LT(once.scale, 1.4);
  EXPECT_EQ(blind.scale, 1.0);
  EXPECT_GT(settled.scale, 2.0);
  EXPECT_LT(settled.scale, 4.0);
  EXPECT_LE(settled.planes, blind.planes);
  EXPECT_GE(settled.treads, 3);  // with the floor
}

TEST(NoiseScale, NoiseBeyondTheBounds_IsHeldAtThem) {
  EXPECT_EQ(look(0.33, 1.0, 3).scale, 1.0);
  // Four times the profile, and what of the rest looks as if it grew with the square of the depth, which has its own.
  const NoiseTracker::Params bounds;
  const double most =
      bounds.max_scale + bounds.max_quadratic_per_m * kDepth_m * kDepth_m / DepthNoiseModel{}.sigma_m(kDepth_m);
  for (const double strength : {5.0, 10.0}) {
    const double scale = look(strength, 1.0, 6).scale;
    EXPECT_GE(scale, bounds.max_scale);
    EXPECT_LE(scale, most);
  }
}

}  // namespace
}  // namespace polygmap
