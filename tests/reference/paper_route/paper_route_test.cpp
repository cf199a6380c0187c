// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/paper_route.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap {
namespace {

test::DepthScene stairs(const test::StairSpec& spec) {
  test::DepthScene scene;
  scene.intrinsics = robot_camera_intrinsics();
  scene.place_camera(0.77, 1.047);
  scene.add_stairs(spec);
  return scene;
}

// Level planes within 10 mm and 2 degrees of a tread at that world height, with a polygon of some size.
int treads_at(const PaperRoute& route, const test::DepthScene& scene, double height_m) {
  int count = 0;
  for (const PaperPlane& found : route.planes()) {
    if (found.kind != SurfaceKind::kTread) continue;
    const Vec3 normal = scene.world_T_camera.R * found.plane.normal();
    const double height = scene.world_T_camera.p_m.z() - found.plane.d_m() / normal.z();
    Vec3 first = found.polygon[0];
    double reach_m = 0.0;
    for (const Vec3& p : found.polygon) reach_m = std::max(reach_m, (p - first).norm());
    count += normal.z() > math::cos(0.035) && std::abs(height - height_m) < 0.01 && reach_m > 0.3 ? 1 : 0;
  }
  return count;
}

TEST(PaperRoute, NoisyStairs_FindsFloorAndTreadsAndRisers) {
  const test::DepthScene scene = stairs({});
  test::DepthPicture picture = test::render(scene);
  test::add_noise(picture, {}, 3);
  const auto route = std::make_unique<PaperRoute>(PaperRoute::Params{});
  const std::vector<std::uint16_t> raw = picture.raw();
  route->run(raw.data(), scene.intrinsics, scene.camera_up());
  for (int step = 0; step <= 2; ++step) EXPECT_GE(treads_at(*route, scene, 0.15 * step), 1) << step;
  int risers = 0;
  for (const PaperPlane& found : route->planes()) risers += found.kind == SurfaceKind::kRiser ? 1 : 0;
  EXPECT_GE(risers, 1);
  EXPECT_LE(route->planes().size(), 10U);
}

TEST(PaperRoute, BlankFrameAfterStairs_HasNoPlanes) {
  const test::DepthScene scene = stairs({});
  const auto route = std::make_unique<PaperRoute>(PaperRoute::Params{});
  std::vector<std::uint16_t> raw = test::render(scene).raw();
  route->run(raw.data(), scene.intrinsics, scene.camera_up());
  EXPECT_FALSE(route->planes().empty());
  raw.assign(raw.size(), 0);
  route->run(raw.data(), scene.intrinsics, scene.camera_up());
  EXPECT_TRUE(route->planes().empty());
}

}  // namespace
}  // namespace polygmap
