// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygon_map.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/seen_stairs.hpp"

namespace polygmap {
namespace {

using test::Noise;
using test::Stairs;

constexpr std::int64_t kFrame_ns = 33'333'333;

double extreme(const MapPolygon& p, const Vec3& u) {
  double most = -1e9;
  for (const Vec3& v : p.surface.polygon) most = std::max(most, u.dot(v));
  return most;
}

// The most that an edge or the height of a step's tread is off, m; stairs of yaw 0.
double tread_error_m(const MapPolygon& tread, const Stairs& stairs, int step) {
  const double half_m = 0.5 * stairs.width_m;
  double most = std::abs(tread.surface.centroid_m.z() - stairs.origin_m.z() - step * stairs.rise_m);
  for (const double error : {-extreme(tread, -Vec3::UnitX()) - stairs.nosing_x_m(step),
                             extreme(tread, Vec3::UnitX()) - stairs.back_x_m(step),
                             extreme(tread, Vec3::UnitY()) - half_m, extreme(tread, -Vec3::UnitY()) - half_m}) {
    most = std::max(most, std::abs(error));
  }
  return most;
}

// A robot that looks and a map that remembers.
class PolygonMapTest : public ::testing::Test {
 protected:
  void fuse(const SurfaceFrame& frame, const Transform& world_T_camera, double position_sigma_m = 0.0,
            double mount_sigma_rad = 0.0) {
    PolygonMap::View view{world_T_camera, position_sigma_m, 0.0, robot_camera_intrinsics()};
    view.mount_sigma_rad = mount_sigma_rad;
    map_->begin(frame, view);
    WorkBudget budget(1 << 20);
    ASSERT_EQ(map_->step(budget), Progress::kDone);
    most_units_ = std::max(most_units_, (1 << 20) - budget.left());
  }
  // pose_error_m: of where the robot believes to be.
  void look(const Stairs& stairs, const Transform& world_T_base, const Noise& noise, const Vec3& pose_error_m,
            double position_sigma_m) {
    stamp_ns_ += kFrame_ns;
    Transform camera = test::camera_of(world_T_base);
    const SurfaceFrame frame = test::seen_from(stairs, camera, stamp_ns_, noise, random_);
    camera.p_m += pose_error_m;
    fuse(frame, camera, position_sigma_m);
  }
  void look(const Stairs& stairs, const Transform& world_T_base, const Noise& noise, int frames = 1) {
    for (int i = 0; i < frames; ++i) look(stairs, world_T_base, noise, Vec3::Zero(), 0.0);
  }
  Vec3 gauss(double sigma) {
    std::normal_distribution<> normal(0.0, sigma);
    const double x = normal(random_), y = normal(random_);
    return {x, y, normal(random_)};
  }
  // The confirmed level polygon within 15 mm of that height, null if there is none.
  const MapPolygon* level_at(double z_m) const {
    for (const MapPolygon& p : map_->snapshot().polygons) {
      if (p.surface.kind == SurfaceKind::kTread && p.sightings >= 5 &&
          std::abs(p.surface.centroid_m.z() - z_m) < 0.015) {
        return &p;
      }
    }
    return nullptr;
  }
  const PolygonMap::Counters& counters() const { return map_->counters(); }

  std::unique_ptr<PolygonMap> map_ = std::make_unique<PolygonMap>();
  std::mt19937 random_{7};
  std::int32_t most_units_ = 0;  // of a frame
  std::int64_t stamp_ns_ = kNsPerS;
  const Transform on_floor_ = test::base_above({-0.45, 0.0, 0.0}, 0.0);
};

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

TEST_F(PolygonMapTest, Jitter5mm_200Frames_NoTreadEdgeMovesBy3mm) {
  struct Case {
    const char* what;
    Noise noise;
    double pose_m, sigma_m;
  };
  const Stairs stairs{.width_m = 0.7};
  for (const Case& c :
       {Case{"edges", {0.005, 0.003, 0.003}, 0.0, 0.0}, Case{"pose", {0.001, 0.001, 0.001}, 0.005, 0.005},
        Case{"pose that claims to be exact", {0.001, 0.001, 0.001}, 0.005, 0.0},
        Case{"edges and pose", {0.0035, 0.002, 0.002}, 0.0035, 0.0035}}) {
    map_->clear();
    double worst_m = 0.0;
    for (int frame = 0; frame < 245; ++frame) {
      look(stairs, on_floor_, c.noise, gauss(c.pose_m), c.sigma_m);
      for (int step = 1; frame >= 45 && step <= 2; ++step) {
        const MapPolygon* tread = level_at(step * stairs.rise_m);
        ASSERT_NE(tread, nullptr) << c.what << ", step " << step << ", frame " << frame;
        ASSERT_TRUE(tread->surface.nosing.valid && tread->surface.back.valid);
        worst_m = std::max(worst_m, tread_error_m(*tread, stairs, step));
      }
    }
    EXPECT_LT(worst_m, 0.003) << c.what;
    int confirmed = 0;
    for (const MapPolygon& p : map_->snapshot().polygons) confirmed += p.sightings >= 5 ? 1 : 0;
    EXPECT_LE(confirmed, 7);  // floor, three treads, three risers: no doubles
  }
}

TEST_F(PolygonMapTest, NosingLine_OverManyRuns_IsUnbiasedAndItsSigmaHonest) {
  const Stairs stairs{.width_m = 1.0};
  double sum = 0.0, sum2 = 0.0, sigma = 0.0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    map_->clear();
    look(stairs, on_floor_, {0.005, 0.002, 0.002}, 60);
    const MapPolygon* tread = level_at(stairs.rise_m);
    ASSERT_NE(tread, nullptr);
    const double error = 0.5 * (tread->surface.nosing.a_m + tread->surface.nosing.b_m).x() - stairs.nosing_x_m(1);
    sum += error;
    sum2 += error * error;
    sigma += tread->surface.nosing.sigma_m / kRuns;
  }
  const double rms = std::sqrt(sum2 / kRuns);
  EXPECT_LT(std::abs(sum / kRuns), 0.0005);
  EXPECT_LT(rms, sigma);        // the systematic part is not in these frames
  EXPECT_GT(rms, 0.2 * sigma);  // but it is not a made-up figure either
  EXPECT_LT(sigma, 0.003);
}

// What the mount turns by, it turns about the camera: an edge moves along the stairs by its depth below, a height by
// its distance ahead.
TEST_F(PolygonMapTest, MountKnownToAFifthOfADegree_EdgesAndHeightsAreAsVague) {
  constexpr double kMount_rad = 0.2 * kPi / 180.0;
  const Stairs stairs{.width_m = 0.7};
  const Transform camera = test::camera_of(on_floor_);
  std::array<SurfacePatch, 2> treads;
  for (const bool vague : {false, true}) {
    map_->clear();
    for (int i = 0; i < 30; ++i) {
      stamp_ns_ += kFrame_ns;
      fuse(test::seen_from(stairs, camera, stamp_ns_, {}, random_), camera, 0.0, vague ? kMount_rad : 0.0);
    }
    const MapPolygon* tread = level_at(stairs.rise_m);
    ASSERT_NE(tread, nullptr);
    treads[vague ? 1 : 0] = tread->surface;
  }
  const auto added = [](double now, double before) { return std::sqrt(now * now - before * before); };
  const double below_m = camera.p_m.z() - stairs.rise_m;
  const double ahead_m = (treads[0].centroid_m - camera.p_m).head<2>().norm();
  EXPECT_NEAR(added(treads[1].nosing.sigma_m, treads[0].nosing.sigma_m), kMount_rad * below_m, 2e-5);
  EXPECT_NEAR(added(treads[1].back.sigma_m, treads[0].back.sigma_m), kMount_rad * below_m, 2e-5);
  EXPECT_NEAR(added(treads[1].offset_sigma_m, treads[0].offset_sigma_m), kMount_rad * ahead_m, 2e-5);
  EXPECT_NEAR(added(treads[1].tilt_sigma_rad, treads[0].tilt_sigma_rad), kMount_rad, 1e-5);
}

// Beside a map that was spared that frame: as good at once, and the same 2 s later.
TEST_F(PolygonMapTest, OneFrame40mmOff_IsForgotten) {
  const Stairs stairs{.width_m = 0.7};
  for (const double sigma_m : {0.0, 0.004}) {
    for (const Vec3& jump_m : {Vec3{0.04, 0, 0}, Vec3{0, 0.04, 0}, Vec3{0, 0, 0.04}, Vec3{0.04, 0, -0.04}}) {
      const auto spared = std::make_unique<PolygonMap>();
      map_->clear();
      for (int frame = 0; frame < 91; ++frame) {
        const Vec3 error_m = frame == 30 ? jump_m : Vec3{Vec3::Zero()};
        look(stairs, on_floor_, {}, error_m, sigma_m);
        if (frame == 30) continue;
        const Transform camera = test::camera_of(on_floor_);
        spared->begin(test::seen_from(stairs, camera, stamp_ns_, {}, random_),
                      {camera, sigma_m, 0.0, robot_camera_intrinsics()});
        WorkBudget budget(1 << 20);
        ASSERT_EQ(spared->step(budget), Progress::kDone);
        for (int step = 1; frame > 30 && step <= 2; ++step) {
          const MapPolygon* tread = level_at(step * stairs.rise_m);
          ASSERT_NE(tread, nullptr);
          EXPECT_LT(tread_error_m(*tread, stairs, step), 0.001) << jump_m.transpose() << ", frame " << frame;
        }
      }
      const MapPolygons &a = map_->snapshot().polygons, &b = spared->snapshot().polygons;
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_EQ(a[i].surface.polygon.size(), b[i].surface.polygon.size());
        for (std::size_t k = 0; k < a[i].surface.polygon.size(); ++k) {
          EXPECT_LT((a[i].surface.polygon[k] - b[i].surface.polygon[k]).norm(), 5e-4) << jump_m.transpose();
        }
      }
      EXPECT_LT(map_->snapshot().drift_m.norm(), 2e-4);
    }
  }
  EXPECT_GT(counters().line_outliers, 0U);
  EXPECT_GT(counters().side_outliers, 0U);
  EXPECT_GT(counters().dropped_unconfirmed, 0U);
  EXPECT_EQ(counters().resets, 0U);
}

TEST_F(PolygonMapTest, WorldThatReallyJumped_NewEvidenceWinsWithin1s) {
  Stairs stairs{.width_m = 0.7};
  look(stairs, on_floor_, {}, 30);
  stairs.origin_m.x() = 0.04;
  look(stairs, on_floor_, {}, 30);
  const MapPolygon* tread = level_at(stairs.rise_m);
  ASSERT_NE(tread, nullptr);
  EXPECT_NEAR(-extreme(*tread, -Vec3::UnitX()), 0.04, 0.002);
  EXPECT_GT(counters().resets, 0U);
}

TEST_F(PolygonMapTest, DriftThatTheCovarianceAdmits_StaysOutOfTheMap) {
  const Stairs stairs{.width_m = 0.7};
  constexpr int kFrames = 300;  // 10 s
  for (const Vec3& ramp_m : {Vec3{0, 0, 0.08}, Vec3{0, 0, -0.08}, Vec3{0.08, 0, 0}}) {
    map_->clear();
    for (int i = 0; i < 30; ++i) look(stairs, on_floor_, {0.003, 0.002, 0.002}, Vec3::Zero(), 0.001);
    double worst_m = 0.0, worst_drift_m = 0.0;
    for (int i = 1; i <= kFrames; ++i) {
      const Vec3 drift_m = (static_cast<double>(i) / kFrames) * ramp_m;
      look(stairs, on_floor_, {0.003, 0.002, 0.002}, drift_m, 0.001 + 0.5 * drift_m.norm());
      for (int step = 1; step <= 2; ++step) {
        const MapPolygon* tread = level_at(step * stairs.rise_m);
        ASSERT_NE(tread, nullptr);
        worst_m = std::max(worst_m, tread_error_m(*tread, stairs, step));
      }
      worst_drift_m = std::max(worst_drift_m, (map_->snapshot().drift_m - drift_m).norm());
    }
    EXPECT_LT(worst_m, 0.01);
    EXPECT_LT(worst_drift_m, 0.01);
    EXPECT_LE(map_->snapshot().polygons.size(), 7U);
  }
}

TEST_F(PolygonMapTest, DriftBeyondTheCovariance_IsFollowed) {
  const Stairs stairs{.width_m = 0.7};
  for (int i = 0; i < 30; ++i) look(stairs, on_floor_, {}, Vec3::Zero(), 0.002);
  for (int i = 1; i <= 300; ++i) look(stairs, on_floor_, {}, Vec3{0, 0, 0.03 * i / 300}, 0.002);
  const MapPolygon* tread = level_at(stairs.rise_m + 0.03);
  ASSERT_NE(tread, nullptr);
  EXPECT_LE(map_->snapshot().drift_m.cwiseAbs().maxCoeff(), 0.006);  // three sigma
  EXPECT_NEAR(tread->surface.centroid_m.z() + map_->snapshot().drift_m.z(), stairs.rise_m + 0.03, 0.005);
}

TEST_F(PolygonMapTest, SlowDrift_IsFollowed) {
  Stairs stairs{.width_m = 0.7};
  look(stairs, on_floor_, {}, 30);
  for (int i = 0; i < 300; ++i) {  // 2 mm/s in every axis over 10 s
    stairs.origin_m += Vec3::Constant(0.002 / 30.0);
    look(stairs, on_floor_, {});
  }
  const MapPolygon* tread = level_at(stairs.rise_m + stairs.origin_m.z());
  ASSERT_NE(tread, nullptr);
  EXPECT_NEAR(tread->surface.centroid_m.z(), stairs.rise_m + stairs.origin_m.z(), 0.0035);
  EXPECT_NEAR(-extreme(*tread, -Vec3::UnitX()), stairs.origin_m.x(), 0.0035);
}

TEST_F(PolygonMapTest, TreadCutByThePicture_DoesNotShrink) {
  const Stairs stairs{.width_m = 0.7};
  look(stairs, on_floor_, {}, 30);
  // Turned away, the picture cuts the right side off; walking on, it cuts the first treads off altogether.
  look(stairs, test::base_above({-0.45, 0.0, 0.0}, 0.45), {}, 60);
  look(stairs, test::base_above({0.05, 0.0, 0.13}, 0.0), {}, 60);
  for (int step = 1; step <= 2; ++step) {
    const MapPolygon* tread = level_at(step * stairs.rise_m);
    ASSERT_NE(tread, nullptr);
    EXPECT_NEAR(-extreme(*tread, -Vec3::UnitX()), stairs.nosing_x_m(step), 0.002);
    EXPECT_NEAR(extreme(*tread, Vec3::UnitX()), stairs.back_x_m(step), 0.002);
    EXPECT_NEAR(extreme(*tread, Vec3::UnitY()), 0.35, 0.002);
    EXPECT_NEAR(extreme(*tread, -Vec3::UnitY()), 0.35, 0.002);
  }
}

TEST_F(PolygonMapTest, WideTreadSeenInParts_GrowsToWhatWasSeen) {
  const Stairs stairs{.width_m = 2.4};
  look(stairs, on_floor_, {}, 10);
  const double before = extreme(*level_at(0.13), Vec3::UnitY());
  EXPECT_LT(before, 1.0);
  look(stairs, test::base_above({-0.45, 0.4, 0.0}, 0.3), {}, 10);
  const double after = extreme(*level_at(0.13), Vec3::UnitY());
  EXPECT_GT(after, before + 0.2);
  EXPECT_LT(after, 1.201);
  EXPECT_EQ(counters().merged, 0U);
}

TEST_F(PolygonMapTest, ImageCutSides_200NoisyFrames_DoNotCreepOutwards) {
  const Stairs stairs{.width_m = 2.4};
  look(stairs, on_floor_, {});
  double true_reach = 0.0;
  for (const MapPolygon& p : map_->snapshot().polygons) {
    if (p.surface.kind == SurfaceKind::kTread && std::abs(p.surface.centroid_m.z() - 0.13) < 0.01) {
      true_reach = extreme(p, Vec3::UnitY()) + PolygonMap::Params{}.unknown_margin_m;
    }
  }
  look(stairs, on_floor_, {0.005, 0.002, 0.002}, 200);
  EXPECT_LT(extreme(*level_at(0.13), Vec3::UnitY()), true_reach + 0.008);
  EXPECT_GT(extreme(*level_at(0.13), Vec3::UnitY()), true_reach - 0.012);
}

TEST_F(PolygonMapTest, FloorAnd40mmStep_StayApart) {
  const Stairs stairs{.steps = 1, .rise_m = 0.04, .landing_m = 0.6};
  look(stairs, on_floor_, {0.005, 0.004, 0.004}, 60);
  ASSERT_NE(level_at(0.0), nullptr);
  ASSERT_NE(level_at(0.04), nullptr);
  EXPECT_NE(level_at(0.0)->id, level_at(0.04)->id);
  const std::uint32_t floor = level_at(0.0)->id, step = level_at(0.04)->id;
  for (int i = 1; i <= 300; ++i) {  // by two of its heights, upwards
    const Vec3 drift_m{0.0, 0.0, 0.08 * i / 300};
    look(stairs, on_floor_, {0.005, 0.004, 0.004}, drift_m, 0.001 + 0.5 * drift_m.z());
  }
  ASSERT_NE(level_at(0.0), nullptr);
  ASSERT_NE(level_at(0.04), nullptr);
  EXPECT_EQ(level_at(0.0)->id, floor);
  EXPECT_EQ(level_at(0.04)->id, step);
}

// A level patch given in the world, seen from straight above.
SurfacePatch level_patch(const Vec3& middle_m, double half_x_m, double half_y_m) {
  SurfacePatch patch;
  patch.kind = SurfaceKind::kTread;
  patch.d_m = -middle_m.z();
  patch.centroid_m = middle_m;
  patch.offset_sigma_m = patch.tilt_sigma_rad = 0.001;
  for (const Vec2& v : {Vec2{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    EXPECT_TRUE(patch.polygon.try_push_back(middle_m + Vec3{v.x() * half_x_m, v.y() * half_y_m, 0.0}));
  }
  return patch;
}

// Camera at a world point, looking straight down, picture up along world x.
Transform looking_down(const Vec3& from_m) {
  Mat3 R;
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  return {R, from_m};
}

SurfaceFrame in_camera(const std::vector<SurfacePatch>& world, const Transform& world_T_camera, std::int64_t stamp_ns) {
  SurfaceFrame frame;
  frame.stamp_ns = stamp_ns;
  const Transform inverse = world_T_camera.inverse();
  for (SurfacePatch patch : world) {
    const Plane plane = inverse * Plane{patch.normal, patch.d_m};
    patch.normal = plane.normal;
    patch.d_m = plane.d_m;
    patch.centroid_m = inverse * patch.centroid_m;
    for (Vec3& v : patch.polygon) v = inverse * v;
    for (EdgeLine* line : {&patch.nosing, &patch.back}) {
      line->a_m = inverse * line->a_m;
      line->b_m = inverse * line->b_m;
    }
    EXPECT_TRUE(frame.surfaces.try_push_back(patch));
  }
  return frame;
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

TEST_F(PolygonMapTest, Full_TheOldestOutOfReachGoesAndIsCounted) {
  std::uint32_t made = 0;
  for (int k = 0; k < 80; ++k) {  // a tread every 0.4 m along a walk
    const Vec3 at{0.4 * k, 0, 0.05 * k};
    const Transform camera = looking_down(at + Vec3{0, 0, 1});
    for (int i = 0; i < 6; ++i) {
      stamp_ns_ += kFrame_ns;
      fuse(in_camera({level_patch(at, 0.14, 0.3)}, camera, stamp_ns_), camera);
    }
    ++made;
    const MapPolygons& polygons = map_->snapshot().polygons;
    EXPECT_EQ(polygons.size(), std::min<std::size_t>(made, kMaxMapPolygons));
  }
  EXPECT_EQ(counters().forgotten, 80U - kMaxMapPolygons);
  EXPECT_EQ(counters().evicted, 0U);
  for (const MapPolygon& p : map_->snapshot().polygons) EXPECT_GT(p.surface.centroid_m.x(), 0.4 * 15.5);
}

TEST_F(PolygonMapTest, FiftyStepsUpAndDown_NothingWithinReachMakesRoom) {
  const Stairs stairs{.steps = 50, .rise_m = 0.15};
  constexpr int kFramesPerStep = 15;
  for (const bool down : {false, true}) {
    for (int i = 0; i < 50 * kFramesPerStep; ++i) {
      const double treads = static_cast<double>(down ? 50 * kFramesPerStep - i : i) / kFramesPerStep;
      const Vec3 middle_m{-0.45 + stairs.tread_m * treads, 0.0, stairs.rise_m * std::floor(treads)};
      look(stairs, test::base_above(middle_m, down ? kPi : 0.0), {0.003, 0.002, 0.002}, gauss(0.002), 0.004);
      ASSERT_LE(map_->snapshot().polygons.size(), kMaxMapPolygons);
    }
    EXPECT_EQ(counters().evicted, 0U);
    EXPECT_EQ(counters().refused, 0U);
    EXPECT_GT(counters().forgotten, 0U);
  }
}

TEST_F(PolygonMapTest, Clutter_TakesNoTreadsPlace) {
  const Transform camera = looking_down({0, 0, 1});
  std::vector<SurfacePatch> seen{level_patch({0, 0, 0.1}, 0.14, 0.3)};
  for (int frame = 0; frame < 40; ++frame) {
    for (std::size_t i = seen.size(); i < kMaxPlanesPerFrame; ++i) {  // within reach, more than the map holds
      const double k = static_cast<double>(i);
      SurfacePatch patch = level_patch({0.02 * k - 0.6, 0.0, -0.5 - 0.04 * k - 0.02 * (frame % 2)}, 0.1, 0.08);
      patch.kind = SurfaceKind::kOther;
      seen.push_back(patch);
    }
    stamp_ns_ += kFrame_ns;
    fuse(in_camera(seen, camera, stamp_ns_), camera);
    seen.resize(1);
  }
  ASSERT_NE(level_at(0.1), nullptr);
  EXPECT_GT(counters().evicted, 0U);
  EXPECT_LT(most_units_, 50 * static_cast<std::int32_t>(kMaxPlanesPerFrame));
  // A tread finds its place among them at once.
  seen.push_back(level_patch({0.3, 0, 0.2}, 0.14, 0.3));
  for (int frame = 0; frame < 5; ++frame) {
    stamp_ns_ += kFrame_ns;
    fuse(in_camera(seen, camera, stamp_ns_), camera);
  }
  EXPECT_NE(level_at(0.1), nullptr);
  EXPECT_NE(level_at(0.2), nullptr);

  SurfacePatch small = level_patch({0, 0, -0.3}, 0.06, 0.06);
  small.kind = SurfaceKind::kOther;
  const std::uint32_t created = counters().created, passed_over = counters().passed_over;
  stamp_ns_ += kFrame_ns;
  fuse(in_camera({small}, camera, stamp_ns_), camera);
  EXPECT_EQ(counters().passed_over, passed_over + 1);
  EXPECT_EQ(counters().created, created);
}

TEST_F(PolygonMapTest, ConfirmedOutOfView_IsRememberedForAMinute) {
  const Stairs stairs{};
  look(stairs, on_floor_, {}, 20);
  const std::uint32_t id = level_at(0.13)->id;
  look(stairs, test::base_above({0.37, 0.0, 0.26}, 0.0), {}, 30 * 60);
  ASSERT_NE(level_at(0.13), nullptr);
  EXPECT_EQ(level_at(0.13)->id, id);
  EXPECT_GT(level_at(0.13)->surface.nosing.sigma_m, 0.005);  // and says that it is old
}

TEST_F(PolygonMapTest, ConfirmedInViewButGone_IsDroppedAfter3s) {
  Stairs stairs{};
  look(stairs, on_floor_, {}, 20);
  ASSERT_NE(level_at(0.26), nullptr);
  stairs.steps = 1;
  look(stairs, on_floor_, {}, 80);
  EXPECT_NE(level_at(0.26), nullptr);  // a few lost frames are no reason
  look(stairs, on_floor_, {}, 20);
  EXPECT_EQ(level_at(0.26), nullptr);
  EXPECT_GE(counters().dropped_vanished, 1U);
}

// Shanks across the view of a tread, seen from above, that is not there any more.
TEST_F(PolygonMapTest, TreadGoneBehindALeg_ForgottenWhereMostOfItsPlaceIsInView) {
  const Transform camera = looking_down({0, 0, 1});
  const auto vanishes_behind = [&](const std::vector<double>& shanks_x_m) {
    map_->clear();
    for (int i = 0; i < 10; ++i) {
      stamp_ns_ += kFrame_ns;
      fuse(in_camera({level_patch({0, 0, 0.1}, 0.14, 0.3)}, camera, stamp_ns_), camera);
    }
    PolygonMap::View view{camera, 0.0, 0.0, robot_camera_intrinsics()};
    for (std::size_t i = 0; i < shanks_x_m.size(); ++i) {  // camera frame, halfway to the tread
      view.body[i].shank = {Vec3{shanks_x_m[i], -0.2, 0.45}, Vec3{shanks_x_m[i], 0.2, 0.45}, 0.03};
    }
    for (int i = 0; i < 100; ++i) {
      SurfaceFrame blank;
      blank.stamp_ns = stamp_ns_ += kFrame_ns;
      map_->begin(blank, view);
      WorkBudget budget(1 << 20);
      EXPECT_EQ(map_->step(budget), Progress::kDone);
    }
    return map_->snapshot().polygons.empty();
  };
  EXPECT_TRUE(vanishes_behind({}));
  EXPECT_TRUE(vanishes_behind({0.0}));           // hides the middle alone
  EXPECT_FALSE(vanishes_behind({-0.08, 0.08}));  // leave a gap at the middle
  EXPECT_TRUE(vanishes_behind({-0.08}));         // hides less than half
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

TEST_F(PolygonMapTest, EdgesSeenOnlyAfterTheTread_TurnItsAxes) {
  Stairs stairs{.width_m = 0.7, .yaw_rad = 0.3};
  const Transform camera = test::camera_of(on_floor_);
  for (int i = 0; i < 40; ++i) {
    stamp_ns_ += kFrame_ns;
    SurfaceFrame frame = test::seen_from(stairs, camera, stamp_ns_, {}, random_);
    for (SurfacePatch& p : frame.surfaces) {
      if (i < 10) p.nosing.valid = p.back.valid = false;
    }
    fuse(frame, camera);
  }
  const MapPolygon* tread = level_at(0.13);
  ASSERT_NE(tread, nullptr);
  EXPECT_NEAR(tread->surface.area_m2, 0.7 * 0.28, 0.003);
  const Vec3 along = tread->surface.nosing.a_m - tread->surface.nosing.b_m;  // left minus right
  EXPECT_NEAR(std::atan2(-along.x(), along.y()), 0.3, 1e-3);
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
  bad.world_T_camera.p_m.x() = std::nan("");
  EXPECT_EQ(begin_with(bad, frame), Progress::kIdle);
  bad = view;
  bad.world_T_camera.R *= 1.1;
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

TEST_F(PolygonMapTest, NosingBehindTheBackEdge_FallsBackToTheEndsAndIsCounted) {
  const Transform camera = looking_down({0, 0, 1});
  SurfacePatch patch = level_patch({0, 0, 0}, 0.14, 0.3);
  patch.nosing = {{-0.10, 0.3, 0}, {-0.10, -0.3, 0}, 0.001, true};
  patch.back = {{-0.12, 0.3, 0}, {-0.12, -0.3, 0}, 0.001, true};
  for (int i = 0; i < 5; ++i) {
    stamp_ns_ += kFrame_ns;
    fuse(in_camera({patch}, camera, stamp_ns_), camera);
  }
  EXPECT_GT(counters().degenerate, 0U);
  ASSERT_EQ(map_->snapshot().polygons.size(), 1U);
  EXPECT_NEAR(map_->snapshot().polygons[0].surface.area_m2, 0.28 * 0.6, 1e-3);
  EXPECT_FALSE(map_->snapshot().polygons[0].surface.nosing.valid);
}

}  // namespace
}  // namespace polygmap
