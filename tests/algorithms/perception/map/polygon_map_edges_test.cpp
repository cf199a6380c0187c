// SPDX-License-Identifier: Apache-2.0
// Edges of the map: where they come to lie, and how well they are known.
#include <gtest/gtest.h>

#include "tests/support/remembered_stairs.hpp"

namespace polygmap {
namespace {

using namespace test;

class PolygonMapEdges : public PolygonMapTest {};

TEST_F(PolygonMapEdges, Jitter5mm_200Frames_NoTreadEdgeMovesBy3mm) {
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

TEST_F(PolygonMapEdges, NosingLine_OverManyRuns_IsUnbiasedAndItsSigmaHonest) {
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
TEST_F(PolygonMapEdges, MountKnownToAFifthOfADegree_EdgesAndHeightsAreAsVague) {
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

// What is learnt of the mount afterwards does not mend what was seen before, nor does coming nearer.
TEST_F(PolygonMapEdges, MountLearntAfterTheLastSighting_EdgesAndHeightsStayAsVague) {
  constexpr double kMount_rad = 0.2 * kPi / 180.0;
  const Stairs stairs{.width_m = 0.7};
  const Transform camera = test::camera_of(on_floor_);
  for (int i = 0; i < 30; ++i) {
    stamp_ns_ += kFrame_ns;
    fuse(test::seen_from(stairs, camera, stamp_ns_, {}, random_), camera, 0.0, kMount_rad);
  }
  ASSERT_NE(level_at(stairs.rise_m), nullptr);
  const SurfacePatch before = level_at(stairs.rise_m)->surface;
  const Transform turned_away = test::camera_of({rotation_z(kPi), on_floor_.p_m + Vec3{0.3, 0.0, stairs.rise_m}});
  stamp_ns_ += kFrame_ns;
  fuse(test::seen_from(stairs, turned_away, stamp_ns_, {}, random_), turned_away, 0.0, 0.0);
  ASSERT_NE(level_at(stairs.rise_m), nullptr);
  const SurfacePatch after = level_at(stairs.rise_m)->surface;
  EXPECT_GE(after.nosing.sigma_m, before.nosing.sigma_m);
  EXPECT_GE(after.offset_sigma_m, before.offset_sigma_m);
  EXPECT_GE(after.tilt_sigma_rad, before.tilt_sigma_rad);
}

TEST_F(PolygonMapEdges, TreadCutByThePicture_DoesNotShrink) {
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

TEST_F(PolygonMapEdges, WideTreadSeenInParts_GrowsToWhatWasSeen) {
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

TEST_F(PolygonMapEdges, ImageCutSides_200NoisyFrames_DoNotCreepOutwards) {
  const Stairs stairs{.width_m = 2.4};
  look(stairs, on_floor_, {});
  double true_reach = 0.0;
  for (const MapPolygon& p : map_->snapshot().polygons) {
    if (p.surface.kind == SurfaceKind::kTread && std::abs(p.surface.centroid_m.z() - 0.13) < 0.01) {
      true_reach = extreme(p, Vec3::UnitY()) + PolygonMap::Params{}.sides.unknown_margin_m;
    }
  }
  look(stairs, on_floor_, {0.005, 0.002, 0.002}, 200);
  EXPECT_LT(extreme(*level_at(0.13), Vec3::UnitY()), true_reach + 0.008);
  EXPECT_GT(extreme(*level_at(0.13), Vec3::UnitY()), true_reach - 0.012);
}

TEST_F(PolygonMapEdges, EdgesSeenOnlyAfterTheTread_TurnItsAxes) {
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

// As from a landing: first the side of a tread of the next flight drops towards the robot, then it stands before it.
TEST_F(PolygonMapEdges, AnotherEdgeIsTheFrontOneFromHere_BecomesTheNosing) {
  const Transform camera = looking_down({0, 0, 1});
  SurfacePatch patch = level_patch({0, 0, 0}, 0.14, 0.3);
  const auto see = [&](const EdgeLine& nosing, int frames) {
    patch.nosing = nosing;
    for (int i = 0; i < frames; ++i) {
      stamp_ns_ += kFrame_ns;
      fuse(in_camera({patch}, camera, stamp_ns_), camera);
    }
    const EdgeLine& line = map_->snapshot().polygons[0].surface.nosing;
    return Vec3{(line.a_m - line.b_m).cwiseAbs()};
  };
  const EdgeLine side{{-0.14, 0.3, 0}, {-0.14, -0.3, 0}, 0.001, true};
  const EdgeLine front{{-0.14, -0.3, 0}, {0.14, -0.3, 0}, 0.001, true};
  EXPECT_NEAR(see(side, 10).y(), 0.6, 0.01);
  EXPECT_NEAR(see(front, 3).y(), 0.6, 0.01) << "a few sightings may err";
  EXPECT_NEAR(see(front, 12).x(), 0.28, 0.01);
}

// A leg before the camera splits a tread in two, and each part seems to end there.
TEST_F(PolygonMapEdges, EndThatALegMakes_IsNoneWhileTheTreadIsSeenToGoOn) {
  const Transform camera = looking_down({0, 0, 1});
  SurfacePatch whole = level_patch({0, 0, 0}, 0.14, 0.3);
  whole.edges.fill(EdgeKind::kUnknown);
  const SurfacePatch part = level_patch({0.05, 0, 0}, 0.09, 0.3), other_part = level_patch({0.1, 0, 0}, 0.04, 0.3);
  const auto near_end_m = [&](const SurfacePatch& patch) {
    stamp_ns_ += kFrame_ns;
    fuse(in_camera({patch}, camera, stamp_ns_), camera);
    return -extreme(map_->snapshot().polygons[0], -Vec3::UnitX());
  };
  const double seen_m = -0.14 + PolygonMap::Params{}.sides.unknown_margin_m;
  for (int i = 0; i < 10; ++i) near_end_m(whole);
  for (int i = 0; i < 12; ++i) EXPECT_NEAR(near_end_m(i % 3 == 2 ? whole : part), seen_m, 1e-3) << "it was seen beyond";
  for (int i = 0; i < 12; ++i) EXPECT_NEAR(near_end_m(i % 2 == 0 ? part : other_part), seen_m, 1e-3) << "they disagree";
  for (int i = 0; i < 8; ++i) near_end_m(part);
  EXPECT_NEAR(near_end_m(part), -0.04, 1e-3) << "who says so again and again is right";
}

TEST_F(PolygonMapEdges, SeenFartherAndFartherBeyondAnEnd_TheEndIsGivenUp) {
  const Transform camera = looking_down({0, 0, 1});
  const auto see = [&](double half_x_m, EdgeKind kind) {
    SurfacePatch patch = level_patch({half_x_m - 0.1, 0, 0}, half_x_m, 0.3);
    patch.edges.fill(kind);
    stamp_ns_ += kFrame_ns;
    fuse(in_camera({patch}, camera, stamp_ns_), camera);
    return extreme(map_->snapshot().polygons[0], Vec3::UnitX());
  };
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(see(0.15, EdgeKind::kObserved), 0.2, 1e-3);
  double end_m = 0.0;
  for (int i = 0; i < 12; ++i) end_m = see(0.2 + 0.006 * i, EdgeKind::kUnknown);
  EXPECT_GT(end_m, 0.35);
}

// A frame mistook the lip of a tread that is gone down for its nosing, which would make all of it lie before its back.
TEST_F(PolygonMapEdges, LipThatFacesTheOtherWay_TurnsTheAxes) {
  const Transform camera = looking_down({0, 0, 1});
  SurfacePatch patch = level_patch({0, 0, 0}, 0.14, 0.3);
  const EdgeLine lip{{-0.14, 0.3, 0}, {-0.14, -0.3, 0}, 0.001, true};
  for (int i = 0; i < 12; ++i) {
    patch.nosing = i == 0 ? lip : EdgeLine{};
    patch.back = i == 0 ? EdgeLine{} : lip;
    patch.back_drops = i > 0;
    stamp_ns_ += kFrame_ns;
    fuse(in_camera({patch}, camera, stamp_ns_), camera);
  }
  const SurfacePatch& told = map_->snapshot().polygons[0].surface;
  EXPECT_NEAR(told.area_m2, 0.28 * 0.6, 1e-3);
  EXPECT_TRUE(told.back.valid && told.back_drops);
  EXPECT_NEAR(told.back.a_m.x(), -0.14, 1e-3);
  EXPECT_FALSE(told.nosing.valid);
}

TEST_F(PolygonMapEdges, NosingBehindTheBackEdge_FallsBackToTheEndsAndIsCounted) {
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
