// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/things/thing_finder.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "algorithms/perception/surface_extractor.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

using test::DepthPicture;
using test::DepthScene;
using test::NoiseSpec;
using test::StairSpec;

constexpr double kRise_m = 0.13, kTread_m = 0.28, kFirst_m = 0.35;
constexpr int kFrames = 6;

DepthScene stair_scene(double nosing_m = 0.0) {
  DepthScene scene;
  scene.intrinsics = robot_camera_intrinsics();
  scene.place_camera(0.77, 1.047, 0.03, 0.01);
  scene.add_stairs(
      {.steps = 4, .rise_m = kRise_m, .tread_m = kTread_m, .first_riser_x_m = kFirst_m, .nosing_m = nosing_m});
  return scene;
}

// On the first tread, its middle so far behind the riser and to the left.
void add_box(DepthScene& scene, double x_m, double y_m, double side_m, double height_m) {
  const Vec3 foot{kFirst_m + x_m, y_m, kRise_m};
  const Vec3 half{0.5 * side_m, 0.5 * side_m, 0.0};
  scene.boxes.push_back({foot - half, foot + half + Vec3{0.0, 0.0, height_m}});
}

class ThingFinderTest : public ::testing::TestWithParam<bool> {
 protected:
  // Visits the sightings of each of some pictures, in the world.
  template <typename Visit>
  void look(const DepthScene& scene, const Visit& visit, double strength = 1.0) {
    auto stage = std::make_unique<SurfaceExtractor>();
    const DepthPicture picture = test::render(scene);
    for (int i = 1; i <= kFrames; ++i) {
      DepthPicture noisy = picture;
      test::add_noise(noisy, {.correlated = GetParam(), .strength = strength}, static_cast<std::uint32_t>(i));
      const std::vector<std::uint16_t> raw = noisy.raw();
      SurfaceExtractor::View view;
      view.intrinsics = scene.intrinsics;
      view.camera_up = scene.camera_up();
      ASSERT_TRUE(stage->try_begin(
          {i, static_cast<std::uint32_t>(i), scene.intrinsics.width_px, scene.intrinsics.height_px, raw.data()}, view));
      WorkBudget budget(1'000'000);
      ASSERT_EQ(stage->step(budget), Progress::kDone);
      std::vector<ThingSighting> seen;
      for (ThingSighting thing : stage->result().things) {
        thing.near_m = scene.world_T_camera * thing.near_m;
        thing.far_m = scene.world_T_camera * thing.far_m;
        seen.push_back(thing);
      }
      visit(seen);
    }
  }
};

TEST_P(ThingFinderTest, StairsWithoutThings_NothingIsSeen) {
  for (const double nosing_m : {0.0, 0.03}) {
    int seen = 0;
    look(stair_scene(nosing_m), [&](const auto& things) { seen += static_cast<int>(things.size()); });
    EXPECT_LE(seen, 2) << "overhang " << nosing_m;
  }
}

TEST_P(ThingFinderTest, Cubes_OfEachHeightAndPlace_AreSeenWhereTheyLie) {
  for (const double height_m : {0.02, 0.03, 0.04}) {
    if (test::kSlowMachine && height_m == 0.03) continue;
    for (const Vec2& at : {Vec2{0.14, 0.0}, {0.14, 0.1}, {0.03, -0.1}, {0.258, 0.05}}) {
      DepthScene scene = stair_scene();
      add_box(scene, at.x(), at.y(), 0.04, height_m);
      int frames = 0;
      look(scene, [&](const auto& things) {
        frames += things.empty() ? 0 : 1;
        for (const ThingSighting& thing : things) {
          EXPECT_NEAR(thing.near_m.y(), at.y(), 0.035);
          EXPECT_NEAR(thing.near_m.z(), kRise_m, 0.006);
          EXPECT_GT(thing.near_m.x(), kFirst_m + at.x() - 0.06);
          EXPECT_LT(thing.far_m.x(), kFirst_m + at.x() + 0.06);
        }
      });
      EXPECT_GE(frames, kFrames - 2) << height_m << " at " << at.transpose();
    }
  }
}

TEST_P(ThingFinderTest, BookAcrossTheTread_IsSeenInEveryColumnThatShowsIt) {
  DepthScene scene = stair_scene();
  add_box(scene, 0.14, 0.0, 0.2, 0.03);
  look(scene, [&](const auto& things) {
    double left_m = -1.0, right_m = 1.0;
    for (const ThingSighting& thing : things) {
      left_m = std::max(left_m, thing.near_m.y());
      right_m = std::min(right_m, thing.near_m.y());
    }
    EXPECT_NEAR(left_m, 0.1, 0.04);
    EXPECT_NEAR(right_m, -0.1, 0.04);
  });
}

INSTANTIATE_TEST_SUITE_P(Noise, ThingFinderTest, ::testing::Bool(),
                         [](const auto& noise) { return noise.param ? "correlated" : "white"; });

}  // namespace
}  // namespace polygmap
