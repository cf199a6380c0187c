// SPDX-License-Identifier: Apache-2.0
// The polygon map on what the camera delivers: rendered pictures, the extractor's surfaces.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <vector>

#include "algorithms/perception/map/polygon_map.hpp"
#include "algorithms/perception/surface_extractor.hpp"
#include "sim_stub/camera/depth_noise.hpp"
#include "sim_stub/camera/depth_renderer.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/seen_stairs.hpp"

namespace polygmap {
namespace {

class RenderedMapTest : public testing::Test {
 protected:
  // A frame from where the robot stands, fused with a pose that is off.
  void look(const Vec3& pose_error_m, double position_sigma_m) {
    const Transform camera = test::camera_of(test::base_above({-0.45, 0.0, 0.0}, 0.0));
    ++frame_;
    const std::int64_t stamp_ns = kNsPerS + frame_ * 33'333'333;
    renderer_.render({camera, solids_, {}, base_T_camera(), false});
    noise_.apply(renderer_, static_cast<std::uint64_t>(frame_), seconds(stamp_ns), depth_.data());
    SurfaceExtractor::View view;
    view.intrinsics = k_;
    view.camera_up = camera.R.transpose() * Vec3::UnitZ();
    ASSERT_TRUE(extractor_->try_begin(
        {stamp_ns, static_cast<std::uint32_t>(frame_), k_.width_px, k_.height_px, depth_.data()}, view));
    WorkBudget budget(1 << 20);
    ASSERT_EQ(extractor_->step(budget), Progress::kDone);
    map_->begin(extractor_->result(), {{camera.R, camera.p_m + pose_error_m}, position_sigma_m, 0.0, k_});
    WorkBudget map_budget(1 << 20);
    ASSERT_EQ(map_->step(map_budget), Progress::kDone);
  }

  // Off the module's knowledge: narrow enough that both sides of a tread are in the picture.
  const sim::StairWorld world_ = sim::make_stairs({.steps = 4, .width_m = 0.7, .jitter_m = 0.0}, 1);
  const std::vector<sim::SolidBox> solids_ = sim::solids_of(world_);
  const CameraIntrinsics k_ = robot_camera_intrinsics();
  sim::DepthRenderer renderer_{k_};
  sim::CameraNoise noise_{{}, k_, 1};
  std::vector<std::uint16_t> depth_ =
      std::vector<std::uint16_t>(static_cast<std::size_t>(k_.width_px) * static_cast<std::size_t>(k_.height_px));
  std::unique_ptr<SurfaceExtractor> extractor_ = std::make_unique<SurfaceExtractor>();
  std::unique_ptr<PolygonMap> map_ = std::make_unique<PolygonMap>();
  std::int64_t frame_ = 0;
};

TEST_F(RenderedMapTest, PoseJitter5mm_200Frames_NoTreadEdgeMovesBy3mm) {
  constexpr std::size_t kSteps = 2;
  constexpr std::array<const char*, 5> kEdges{"nosing", "back", "right side", "left side", "height"};
  const auto edges_of = [this](std::size_t step) {
    int found = 0;
    std::array<double, 5> edges{};
    for (const MapPolygon& p : map_->snapshot().polygons) {
      const SurfacePatch& tread = p.surface;
      // One frame in three thousand is so far off that it makes ghosts, which nobody confirms.
      if (tread.kind != SurfaceKind::kTread || p.sightings < 5) continue;
      if (std::abs(tread.centroid_m.z() - world_.steps[step].height_m) > 0.03) continue;
      ++found;
      Vec3 low_m = tread.polygon[0], high_m = tread.polygon[0];
      for (const Vec3& v : tread.polygon) {
        low_m = low_m.cwiseMin(v);
        high_m = high_m.cwiseMax(v);
      }
      edges = {low_m.x(), high_m.x(), low_m.y(), high_m.y(), tread.centroid_m.z()};
    }
    EXPECT_EQ(found, 1) << "step " << step << ", frame " << frame_;
    return edges;
  };
  std::array<std::array<double, 5>, kSteps> truth;
  for (std::size_t step = 0; step < kSteps; ++step) {
    const sim::Step& s = world_.steps[step];
    truth[step] = {s.nosing_x_m, s.back_x_m, -world_.half_width_m, world_.half_width_m, s.height_m};
  }

  std::mt19937 random(3);
  std::normal_distribution<> jitter_m(0.0, 0.005);
  std::array<double, 5> worst_m{};
  for (int i = 0; i < 245; ++i) {
    const double x_m = jitter_m(random), y_m = jitter_m(random);
    look({x_m, y_m, jitter_m(random)}, 0.005);
    for (std::size_t step = 0; i >= 45 && step < kSteps; ++step) {
      const std::array<double, 5> edges = edges_of(step);
      for (std::size_t e = 0; e < 5; ++e) worst_m[e] = std::max(worst_m[e], std::abs(edges[e] - truth[step][e]));
    }
  }
  for (std::size_t e = 0; e < 5; ++e) EXPECT_LT(worst_m[e], 0.003) << kEdges[e];
}

}  // namespace
}  // namespace polygmap
