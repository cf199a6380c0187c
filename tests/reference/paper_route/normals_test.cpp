// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/normals.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>

#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/reference/paper_route/back_projection.hpp"

namespace polygmap {
namespace {

Vec3 normal_at(const NormalImage& image, std::int32_t c, std::int32_t r) {
  return Vec3{static_cast<double>(image.x(c, r)), static_cast<double>(image.y(c, r)),
              static_cast<double>(image.z(c, r))} /
         static_cast<double>(kNormalScale);
}

struct Scene {
  HalfRays rays;
  std::unique_ptr<InverseDepthImage> w = std::make_unique<InverseDepthImage>();
  std::unique_ptr<NormalImage> normals = std::make_unique<NormalImage>();
  std::unique_ptr<NormalEstimation> stage = std::make_unique<NormalEstimation>();

  Scene() { rays.set(robot_camera_intrinsics()); }
  void draw(const Vec3& normal, double d_m) {
    for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
      for (std::int32_t c = 0; c < kHalfWidth_px; ++c) {
        (*w)(c, r) = static_cast<float>(-normal.dot(rays.ray(c, r)) / d_m);
      }
    }
  }
  void run() {
    for (std::int32_t r = 0; r < kHalfHeight_px; ++r) stage->estimate_row({}, rays, *w, r, *normals);
  }
};

TEST(Normals, Eq12_PlanesOfAllLeans_AreTheirNormalsTowardsTheViewer) {
  Scene scene;
  for (const Vec3& direction : {Vec3{0, -0.5, -0.866}, Vec3{0.1, -0.86, -0.5}, Vec3{0.5, 0.2, -0.8}, Vec3{0, 0, -1}}) {
    const Vec3 normal = direction.normalized();
    scene.draw(normal, 0.7);
    scene.run();
    for (std::int32_t r = 0; r < kHalfHeight_px; r += 13) {
      for (std::int32_t c = 0; c < kHalfWidth_px; c += 13) {
        if ((*scene.w)(c, r) < 0.3F) continue;
        ASSERT_GT(normal_at(*scene.normals, c, r).dot(normal), 0.9995) << c << " " << r;
      }
    }
  }
}

TEST(Normals, Eq12_ThreePixelNeighbourhood_IsTheCrossProductOfBackProjectedDifferences) {
  Scene scene;
  CameraIntrinsics half{kHalfWidth_px,    kHalfHeight_px, scene.rays.fx_px, scene.rays.fy_px, scene.rays.cx_px,
                        scene.rays.cy_px, 0.001};
  // A curved surface: only the formula itself gives the right answer.
  const auto depth = [](double c, double r) { return 0.8 + 1e-4 * (c - 150) * (c - 150) / 20 + 0.002 * r; };
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < kHalfWidth_px; ++c) (*scene.w)(c, r) = static_cast<float>(1.0 / depth(c, r));
  }
  constexpr std::int32_t kColumn = 170, kRow = 120;
  scene.stage->estimate_row({.baseline_px = 1, .row_average_px = 0}, scene.rays, *scene.w, kRow, *scene.normals);
  const auto p = [&](double c, double r) { return back_project(half, c, r, depth(c, r)); };
  const Vec3 a = p(kColumn + 1, kRow) - p(kColumn - 1, kRow), b = p(kColumn, kRow + 1) - p(kColumn, kRow - 1);
  const Vec3 expected = b.cross(a).normalized();
  EXPECT_LT((normal_at(*scene.normals, kColumn, kRow) - expected).norm(), 2e-3);
}

TEST(Normals, PixelWithoutData_HasNoneAndNeverNaN) {
  Scene scene;
  scene.draw(Vec3{0, -0.5, -0.866}.normalized(), 0.7);
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < 100; ++c) (*scene.w)(c, r) = 0.0F;
  }
  scene.run();
  EXPECT_EQ(normal_at(*scene.normals, 50, 100).norm(), 0.0);
  EXPECT_EQ(normal_at(*scene.normals, 99, 100).norm(), 0.0);
  EXPECT_NEAR(normal_at(*scene.normals, 200, 100).norm(), 1.0, 1e-3);
}

}  // namespace
}  // namespace polygmap
