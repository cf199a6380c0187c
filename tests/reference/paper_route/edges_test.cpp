// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/edges.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/robot_camera.hpp"

namespace polygmap {
namespace {

struct EdgeScene {
  HalfRays rays;
  std::unique_ptr<InverseDepthImage> w = std::make_unique<InverseDepthImage>();
  std::unique_ptr<NormalImage> normals = std::make_unique<NormalImage>();
  std::unique_ptr<NormalEstimation> estimation = std::make_unique<NormalEstimation>();
  std::unique_ptr<EdgeDetection> stage = std::make_unique<EdgeDetection>();

  EdgeScene() { rays.set(robot_camera_intrinsics()); }
  void run(const EdgeDetection::Params& params = {}) {
    const std::int32_t height = rays.height_px;
    for (std::int32_t r = 0; r < height; ++r) estimation->estimate_row({}, rays, *w, r, *normals);
    for (std::int32_t r = 0; r < height; ++r) stage->gradient_row(params, rays, *normals, *w, r);
    for (std::int32_t r = 0; r < height; ++r) stage->suppress_row(params, rays, r);
    for (std::int32_t i = 0; i < params.sweeps; ++i) {
      for (std::int32_t r = 0; r < height; ++r) {
        stage->grow_row(rays.width_px, height, i % 2 == 0 ? r : height - 1 - r, i % 2 == 0);
      }
    }
  }
  // Edge pixels per column between two rows, and the mean row.
  void count(std::int32_t column, int& pixels, double& row) const {
    pixels = 0;
    row = 0.0;
    for (std::int32_t r = 0; r < rays.height_px; ++r) {
      if (!stage->edge(column, r)) continue;
      ++pixels;
      row += r;
    }
    row /= std::max(pixels, 1);
  }
};

// w = -n . ray / d for two planes; the nearer one wins below the crease and the farther one above, or the other way
// round.
float inverse_depth(const Vec3& ray, const Vec3& normal, double d_m) {
  return static_cast<float>(-normal.dot(ray) / d_m);
}

TEST(Edges, CreaseBetweenTreadAndRiser_IsOneThinLineAtTheCrease) {
  EdgeScene scene;
  const Vec3 tread = Vec3{0, -0.5, -0.866}.normalized(), riser = Vec3{0, 0.866, -0.5}.normalized();
  // Both meet where n_t . ray / d_t = n_r . ray / d_r.
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < kHalfWidth_px; ++c) {
      const Vec3 ray = scene.rays.ray(c, r);
      (*scene.w)(c, r) = std::max(inverse_depth(ray, tread, 0.7), inverse_depth(ray, riser, 0.4));
    }
  }
  scene.run();
  const auto on_tread = [&](std::int32_t r) {
    const Vec3 ray = scene.rays.ray(160, r);
    return inverse_depth(ray, tread, 0.7) > inverse_depth(ray, riser, 0.4);
  };
  double crease = -1.0;
  for (std::int32_t r = 1; r < kHalfHeight_px && crease < 0.0; ++r) {
    if (on_tread(r) != on_tread(r - 1)) crease = r - 0.5;
  }
  ASSERT_GT(crease, 10.0);
  for (std::int32_t c = 20; c < 300; c += 20) {
    int pixels = 0;
    double row = 0.0;
    scene.count(c, pixels, row);
    EXPECT_GE(pixels, 1) << c;
    EXPECT_LE(pixels, 2) << c;
    EXPECT_NEAR(row, crease, 2.0) << c;
  }
}

TEST(Edges, DepthJumpBetweenParallelPlanes_IsAnEdge) {
  EdgeScene scene;
  const Vec3 tread = Vec3{0, -0.5, -0.866}.normalized();
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < kHalfWidth_px; ++c) {
      (*scene.w)(c, r) = inverse_depth(scene.rays.ray(c, r), tread, r < 120 ? 0.6 : 0.7);
    }
  }
  scene.run();
  for (std::int32_t c = 20; c < 300; c += 20) {
    EXPECT_TRUE(scene.stage->edge(c, 119) || scene.stage->edge(c, 120) || scene.stage->edge(c, 118) ||
                scene.stage->edge(c, 121))
        << c;
  }
}

TEST(Edges, PlainPlane_HasNone) {
  EdgeScene scene;
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < kHalfWidth_px; ++c) {
      (*scene.w)(c, r) = inverse_depth(scene.rays.ray(c, r), Vec3{0.1, -0.5, -0.85}.normalized(), 0.7);
    }
  }
  scene.run();
  for (std::int32_t c = 5; c < 315; c += 5) {
    int pixels = 0;
    double row = 0.0;
    scene.count(c, pixels, row);
    EXPECT_EQ(pixels, 0) << c;
  }
}

TEST(Edges, Hysteresis_WeakPixelsNextToStrongOnes_AreKeptAndLoneOnesAreNot) {
  // A jump whose height grows along the row from nothing: weak first, strong later.
  const auto edges_with = [](double high) {
    EdgeScene scene;
    for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
      for (std::int32_t c = 0; c < kHalfWidth_px; ++c) {
        (*scene.w)(c, r) = r < 120 ? 1.0F : 1.0F + 0.00012F * static_cast<float>(c);
      }
    }
    scene.run({.low = 0.05, .high = high, .jump_m = 0.02 / 0.36 * high, .jump_per_m2 = 0.01 / 0.36 * high});
    int pixels = 0;
    for (std::int32_t r = 115; r < 126; ++r) {
      for (std::int32_t c = 5; c < 315; ++c) pixels += scene.stage->edge(c, r) ? 1 : 0;
    }
    return pixels;
  };
  const int kept = edges_with(0.3), none = edges_with(2.0);
  EXPECT_GT(kept, 150);
  EXPECT_EQ(none, 0);
}

}  // namespace
}  // namespace polygmap
