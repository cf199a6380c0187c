// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/polygon_map.hpp"

#include <gtest/gtest.h>

#include "sim_stub/robot_camera.hpp"
#include "tests/support/remembered_stairs.hpp"

namespace polygmap {
namespace {

using namespace test;

TEST_F(PolygonMapTest, OneFrame_EveryVisibleSurface_IsThereWithItsKind) {
  look({}, on_floor_, {});
  int treads = 0, risers = 0;
  for (const MapPolygon& p : map_->snapshot().polygons) {
    treads += p.surface.kind == SurfaceKind::kTread ? 1 : 0;
    risers += p.surface.kind == SurfaceKind::kRiser ? 1 : 0;
    EXPECT_NEAR(p.surface.normal.norm(), 1.0, 1e-9);
    for (const Vec3& v : p.surface.polygon) EXPECT_NEAR(p.surface.normal.dot(v) + p.surface.d_m, 0.0, 1e-9);
  }
  EXPECT_EQ(treads, 3);  // the floor and two steps
  EXPECT_GE(risers, 2);
  EXPECT_EQ(map_->snapshot().stamp_ns, stamp_ns_);
}

TEST_F(PolygonMapTest, PatchesOfOneTreadBesideTheRobotsLeg_AreOneTread) {
  const Transform camera = looking_down({0, 0, 1});
  SurfacePatch left = level_patch({0, 0.35, 0.1}, 0.14, 0.15), right = level_patch({0, -0.35, 0.1}, 0.14, 0.15);
  left.edges[0] = right.edges[2] = EdgeKind::kUnknown;  // at the leg
  for (int i = 0; i < 5; ++i) {
    stamp_ns_ += kFrame_ns;
    fuse(in_camera({left, right}, camera, stamp_ns_), camera);
  }
  ASSERT_EQ(map_->snapshot().polygons.size(), 1U);
  const MapPolygon& tread = map_->snapshot().polygons[0];
  EXPECT_EQ(tread.sightings, 5U);
  EXPECT_NEAR(extreme(tread, Vec3::UnitY()), 0.5, 1e-3);
  EXPECT_NEAR(extreme(tread, -Vec3::UnitY()), 0.5, 1e-3);
  EXPECT_EQ(counters().created, 1U);
}

// Where the robot is met, ground is taken to be level about its soles; here none of it is seen but one surface ahead.
TEST_F(PolygonMapTest, SlopeAhead_IsNoLevelGroundOnceItWasSeenTwice) {
  const auto tells_level_there = [&](double slope_rad, int frames) {
    map_ = std::make_unique<PolygonMap>(PolygonMap::Params{});
    const Transform camera = looking_down({0.3, 0, 1});
    SurfacePatch patch = level_patch({0.3, 0, 0.0}, 0.1, 0.1);
    patch.normal = Vec3{-math::sin(slope_rad), 0.0, math::cos(slope_rad)};
    patch.d_m = -patch.normal.dot(patch.centroid_m);
    for (Vec3& v : patch.polygon) v = Plane{patch.normal, patch.d_m}.project(v);
    PolygonMap::View view{camera, 0.0, 0.0, robot_camera_intrinsics()};
    view.tell_ground = true;
    view.stands = {true, true};
    view.sole = SoleModel{}.contact;
    view.odom_T_sole = {Transform{Mat3::Identity(), Vec3{0.0, 0.1, 0.0}},
                        Transform{Mat3::Identity(), Vec3{0.0, -0.1, 0.0}}};
    for (int i = 0; i < frames; ++i) {
      stamp_ns_ += kFrame_ns;
      map_->begin(in_camera({patch}, camera, stamp_ns_), view);
      WorkBudget budget(1 << 20);
      EXPECT_EQ(map_->step(budget), Progress::kDone);
    }
    const GroundView& ground = map_->snapshot().ground;
    const Vec2 p_m = Vec2{0.3, 0.0} - ground.corner_m;
    return GroundView::has(ground.level, GroundView::cell_of(p_m.x()), GroundView::cell_of(p_m.y()));
  };
  EXPECT_TRUE(tells_level_there(0.02, 8));
  EXPECT_FALSE(tells_level_there(0.06, 8));
  EXPECT_FALSE(tells_level_there(0.06, 2));
  EXPECT_TRUE(tells_level_there(0.06, 1)) << "one noisy frame";
}

// Risers are matched from up to 60 mm off, and may have moved by 25 mm.
TEST_F(PolygonMapTest, RiserSeenElsewhere_OnlyItsOutliersCountUntilTheyPersist) {
  const Transform camera = looking_down({0, 0, 1});
  const auto see_riser_at = [&](double x_m, double rmse_m) {
    SurfacePatch riser;
    riser.kind = SurfaceKind::kRiser;
    riser.normal = -Vec3::UnitX();
    riser.d_m = x_m;
    riser.centroid_m = {x_m, 0.0, 0.1};
    riser.offset_sigma_m = riser.tilt_sigma_rad = 0.001;
    riser.rmse_m = rmse_m;
    for (const Vec2& v : {Vec2{0.3, 0.05}, {-0.3, 0.05}, {-0.3, 0.15}, {0.3, 0.15}}) {
      EXPECT_TRUE(riser.polygon.try_push_back({x_m, v.x(), v.y()}));
    }
    stamp_ns_ += kFrame_ns;
    fuse(in_camera({riser}, camera, stamp_ns_), camera);
  };
  for (int i = 0; i < 10; ++i) see_riser_at(0.2, 0.001);
  const std::int64_t last_ns = stamp_ns_;
  const std::uint32_t persistent = PolygonMap::Params{}.outliers_to_reset;
  for (std::uint32_t i = 1; i < persistent; ++i) see_riser_at(0.24, 0.01);
  ASSERT_EQ(map_->snapshot().polygons.size(), 1U);
  const MapPolygon& riser = map_->snapshot().polygons[0];
  EXPECT_EQ(counters().plane_outliers, persistent - 1);
  EXPECT_EQ(counters().fused, 9U);
  EXPECT_EQ(riser.sightings, 10U);
  EXPECT_EQ(riser.last_seen_ns, last_ns);
  EXPECT_EQ(map_->snapshot().stamp_ns, last_ns);
  EXPECT_NEAR(riser.surface.rmse_m, 0.001, 1e-9);
  EXPECT_NEAR(riser.surface.centroid_m.x(), 0.2, 1e-6);
  see_riser_at(0.24, 0.01);
  EXPECT_EQ(counters().resets, 1U);
  EXPECT_EQ(riser.sightings, 11U);
  EXPECT_EQ(riser.last_seen_ns, stamp_ns_);
  EXPECT_NEAR(riser.surface.centroid_m.x(), 0.24, 1e-6);
}

TEST_F(PolygonMapTest, TwoPolygonsBridgedByOneSighting_BecomeOne) {
  const Transform camera = looking_down({0, 0, 2});
  for (int i = 0; i < 5; ++i) {
    stamp_ns_ += kFrame_ns;
    fuse(
        in_camera({level_patch({0, 0.5, 0.1}, 0.14, 0.15), level_patch({0, -0.5, 0.1}, 0.14, 0.15)}, camera, stamp_ns_),
        camera);
  }
  ASSERT_EQ(map_->snapshot().polygons.size(), 2U);
  const std::uint32_t oldest = map_->snapshot().polygons[0].id;
  for (int i = 0; i < 20; ++i) {
    stamp_ns_ += kFrame_ns;
    fuse(in_camera({level_patch({0, 0, 0.1}, 0.14, 0.65)}, camera, stamp_ns_), camera);
  }
  ASSERT_EQ(map_->snapshot().polygons.size(), 1U);
  EXPECT_EQ(map_->snapshot().polygons[0].id, oldest);
  EXPECT_EQ(counters().merged, 1U);
  EXPECT_NEAR(extreme(map_->snapshot().polygons[0], Vec3::UnitY()), 0.65, 1e-3);
}

TEST_F(PolygonMapTest, FrameWithoutSurfaces_DoesNotMakeTheMapFresh) {
  look({}, on_floor_, {});
  const std::int64_t seen = stamp_ns_;
  SurfaceFrame blank;
  blank.stamp_ns = stamp_ns_ + kFrame_ns;
  fuse(blank, test::camera_of(on_floor_));
  EXPECT_EQ(map_->snapshot().stamp_ns, seen);
  EXPECT_EQ(counters().frames, 2U);
}

TEST_F(PolygonMapTest, Slicing_DoesNotChangeTheMap) {
  const Stairs stairs{};
  const Transform camera = test::camera_of(on_floor_);
  const auto other = std::make_unique<PolygonMap>();
  for (int i = 0; i < 30; ++i) {
    stamp_ns_ += kFrame_ns;
    const SurfaceFrame frame = test::seen_from(stairs, camera, stamp_ns_, {0.005, 0.002, 0.002}, random_);
    fuse(frame, camera);
    other->begin(frame, {camera, 0.0, 0.0, robot_camera_intrinsics()});
    for (int k = 0; k < 10000; ++k) {
      WorkBudget budget(1 + k % 5);
      if (other->step(budget) == Progress::kDone) break;
    }
  }
  const MapPolygons &a = map_->snapshot().polygons, &b = other->snapshot().polygons;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].surface.polygon.size(), b[i].surface.polygon.size());
    for (std::size_t k = 0; k < a[i].surface.polygon.size(); ++k) {
      EXPECT_EQ(a[i].surface.polygon[k], b[i].surface.polygon[k]);
    }
  }
}

TEST_F(PolygonMapTest, SnapshotBetweenSteps_StaysThatOfTheLastFrame) {
  const Stairs stairs{};
  look(stairs, on_floor_, {});
  const std::int64_t stamp = map_->snapshot().stamp_ns;
  const Transform camera = test::camera_of(on_floor_);
  map_->begin(test::seen_from(stairs, camera, stamp_ns_ + kFrame_ns, {}, random_),
              {camera, 0, 0, robot_camera_intrinsics()});
  Progress progress = Progress::kBusy;
  for (int i = 0; i < 10000 && progress == Progress::kBusy; ++i) {
    EXPECT_EQ(map_->snapshot().stamp_ns, stamp);
    EXPECT_EQ(map_->snapshot().polygons[0].sightings, 1U);
    WorkBudget budget(1);
    progress = map_->step(budget);
  }
  EXPECT_EQ(progress, Progress::kDone);
  EXPECT_EQ(map_->snapshot().polygons[0].sightings, 2U);
}

TEST_F(PolygonMapTest, InvalidInput_IsRejectedAndCounted) {
  const Transform camera = looking_down({0, 0, 1});
  const PolygonMap::View view{camera, 0, 0, robot_camera_intrinsics()};
  const auto begin_with = [&](const PolygonMap::View& v, const SurfaceFrame& f) {
    map_->begin(f, v);
    WorkBudget budget(1 << 20);
    return map_->step(budget);
  };
  SurfaceFrame frame = in_camera({level_patch({0, 0, 0}, 0.2, 0.2)}, camera, 100);
  PolygonMap::View bad = view;
  bad.odom_T_camera.p_m.x() = std::nan("");
  EXPECT_EQ(begin_with(bad, frame), Progress::kIdle);
  bad = view;
  bad.odom_T_camera.R *= 1.1;
  EXPECT_EQ(begin_with(bad, frame), Progress::kIdle);
  bad = view;
  bad.intrinsics.fx_px = 0.0;
  EXPECT_EQ(begin_with(bad, frame), Progress::kIdle);
  bad = view;
  bad.mount_sigma_rad = std::nan("");
  EXPECT_EQ(begin_with(bad, frame), Progress::kIdle);
  EXPECT_EQ(counters().rejected_frames, 4U);

  EXPECT_EQ(begin_with(view, frame), Progress::kDone);
  EXPECT_EQ(begin_with(view, frame), Progress::kIdle);
  EXPECT_EQ(counters().stale_frames, 1U);

  frame.stamp_ns = 200;
  map_->begin(frame, view);
  frame.stamp_ns = 300;
  map_->begin(frame, view);
  EXPECT_EQ(counters().abandoned_frames, 1U);

  std::uint32_t rejected = 0;
  const auto reject = [&](auto&& spoil) {
    SurfaceFrame f = in_camera({level_patch({0, 0, 0}, 0.2, 0.2)}, camera, frame.stamp_ns += 100);
    spoil(f.surfaces[0]);
    EXPECT_EQ(begin_with(view, f), Progress::kDone);
    EXPECT_EQ(counters().rejected_surfaces, ++rejected);
  };
  reject([](SurfacePatch& p) { p.polygon.clear(); });
  reject([](SurfacePatch& p) { p.polygon[2].y() = std::nan(""); });
  reject([](SurfacePatch& p) { p.normal *= 2.0; });
  reject([](SurfacePatch& p) { p.offset_sigma_m = -1.0; });
  reject([](SurfacePatch& p) { p.tilt_sigma_rad = std::nan(""); });
  reject([](SurfacePatch& p) { p.d_m = INFINITY; });
  reject([](SurfacePatch& p) { p.centroid_m.z() = 1e9; });
  reject([](SurfacePatch& p) { p.nosing = {Vec3::Constant(std::nan("")), Vec3::Zero(), 0.001, true}; });
  reject([](SurfacePatch& p) { p.kind = SurfaceKind::kRiser; });  // level
  reject([](SurfacePatch& p) {
    p.normal = -p.normal;
    p.d_m = -p.d_m;
  });  // seen from behind
}

}  // namespace
}  // namespace polygmap
