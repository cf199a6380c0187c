// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_extractor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "algorithms/robot/leg_kinematics.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

using test::DepthPicture;
using test::DepthScene;
using test::NoiseSpec;
using test::StairSpec;

DepthScene stair_scene(const StairSpec& stairs, double yaw_rad = 0.0, double pitch_rad = 1.047) {
  DepthScene scene;
  scene.intrinsics = robot_camera_intrinsics();
  scene.place_camera(0.77, pitch_rad, yaw_rad, 0.01);
  scene.add_stairs(stairs);
  return scene;
}

class Extraction {
 public:
  explicit Extraction(const SurfaceExtractor::Params& params = {})
      : stage_(std::make_unique<SurfaceExtractor>(params)) {}

  // Null when the frame was refused.
  const SurfaceFrame* run_raw(const DepthScene& scene, const std::vector<std::uint16_t>& raw, bool filter_legs = true) {
    SurfaceExtractor::View view;
    view.intrinsics = scene.intrinsics;
    // The estimator's up is half a degree off.
    view.camera_up = rotation_z(0.006) * rotation_x(0.006) * scene.camera_up();
    if (filter_legs) view.body = scene.legs;
    const DepthFrameView frame{++stamp_, 1, scene.intrinsics.width_px, scene.intrinsics.height_px, raw.data()};
    if (!stage_->try_begin(frame, view)) return nullptr;
    WorkBudget budget(1'000'000);
    EXPECT_EQ(stage_->step(budget), Progress::kDone);
    return &stage_->result();
  }
  const SurfaceFrame& run(const DepthScene& scene, const NoiseSpec& noise, std::uint32_t seed,
                          bool filter_legs = true) {
    DepthPicture picture = test::render(scene);
    test::add_noise(picture, noise, seed);
    const SurfaceFrame* frame = run_raw(scene, picture.raw(), filter_legs);
    EXPECT_NE(frame, nullptr);
    return *frame;
  }
  SurfaceExtractor& stage() { return *stage_; }

 private:
  std::unique_ptr<SurfaceExtractor> stage_;
  std::int64_t stamp_ = 0;
};

// The convex pieces of the level surface at a world height.
std::vector<const SurfacePatch*> pieces_at(const SurfaceFrame& frame, const DepthScene& scene, double height_m) {
  std::vector<const SurfacePatch*> found;
  for (const SurfacePatch& s : frame.surfaces) {
    if (s.kind != SurfaceKind::kTread) continue;
    if (std::abs((scene.world_T_camera * s.centroid_m).z() - height_m) < 0.02) found.push_back(&s);
  }
  return found;
}
// The one piece there is, else null.
const SurfacePatch* tread_at(const SurfaceFrame& frame, const DepthScene& scene, double height_m) {
  const auto pieces = pieces_at(frame, scene, height_m);
  return pieces.size() == 1 ? pieces.front() : nullptr;
}

double line_error_m(const DepthScene& scene, const EdgeLine& line, double x_m) {
  return std::max(std::abs((scene.world_T_camera * line.a_m).x() - x_m),
                  std::abs((scene.world_T_camera * line.b_m).x() - x_m));
}

void expect_well_formed(const SurfaceFrame& frame) {
  for (const SurfacePatch& s : frame.surfaces) {
    EXPECT_NEAR(s.normal.norm(), 1.0, 1e-9);
    EXPECT_GT(s.d_m, 0.0);
    EXPECT_TRUE(std::isfinite(s.offset_sigma_m) && s.offset_sigma_m > 0.0 && s.tilt_sigma_rad > 0.0);
    EXPECT_TRUE(std::isfinite(s.rmse_m) && s.area_m2 > 0.0);
    ASSERT_GE(s.polygon.size(), 3U);
    const std::size_t n = s.polygon.size();
    double area = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 &a = s.polygon[i], &b = s.polygon[(i + 1) % n], &c = s.polygon[(i + 2) % n];
      EXPECT_NEAR(s.normal.dot(a) + s.d_m, 0.0, 1e-9);
      EXPECT_GE(s.normal.dot((b - a).cross(c - b)), -1e-9) << "not convex or not counter-clockwise from outside";
      area += 0.5 * s.normal.dot((a - s.centroid_m).cross(b - s.centroid_m));
    }
    EXPECT_NEAR(area, s.area_m2, 1e-9);
  }
}

class StairNoise : public ::testing::TestWithParam<bool> {};

TEST_P(StairNoise, Stairs_RisesYawsAndNosings_TreadsNosingsAndBackLinesAreExact) {
  const NoiseSpec noise{.correlated = GetParam()};
  std::uint32_t seed = 0;
  int nosings = 0, backs = 0;
  for (const auto& [rise_m, yaw_rad, nosing_m, first_m] :
       {std::tuple{0.10, 0.0, 0.0, 0.35}, std::tuple{0.13, 0.15, 0.0, 0.25}, std::tuple{0.17, -0.17, 0.0, 0.3},
        std::tuple{0.15, 0.05, 0.02, 0.2}}) {
    StairSpec stairs;
    stairs.rise_m = rise_m;
    stairs.nosing_m = nosing_m;
    stairs.first_riser_x_m = first_m;
    const DepthScene scene = stair_scene(stairs, yaw_rad);
    Extraction extraction;
    const SurfaceFrame& frame = extraction.run(scene, noise, ++seed);
    expect_well_formed(frame);
    EXPECT_EQ(frame.dropped, 0U);
    for (int k = 1; k <= 2; ++k) {
      const SurfacePatch* tread = tread_at(frame, scene, k * rise_m);
      ASSERT_NE(tread, nullptr) << "rise " << rise_m << " tread " << k;
      EXPECT_NEAR((scene.world_T_camera * tread->centroid_m).z(), k * rise_m, GetParam() ? 0.003 : 0.0015);
      EXPECT_LT(math::acos(std::min(1.0, tread->normal.dot(scene.camera_up()))), 0.02);
      const double front_m = first_m + (k - 1) * stairs.tread_m - nosing_m;
      ASSERT_TRUE(tread->nosing.valid) << "rise " << rise_m << " tread " << k;
      EXPECT_LT(line_error_m(scene, tread->nosing, front_m), 0.0035) << "rise " << rise_m << " tread " << k;
      ++nosings;
      if (!tread->back.valid) continue;
      EXPECT_LT(line_error_m(scene, tread->back, front_m + nosing_m + stairs.tread_m), 0.0045);
      ++backs;
    }
  }
  EXPECT_EQ(nosings, 8);
  EXPECT_GE(backs, 5);
}
// A strip of 70 mm along the first nosing has no depth; how many rows that is in the middle of the picture.
int blank_first_nosing(const DepthScene& scene, const StairSpec& stairs, DepthPicture& picture) {
  const CameraIntrinsics& k = scene.intrinsics;
  const Vec3& eye_m = scene.world_T_camera.p_m;
  int rows = 0;
  for (int r = 0; r < k.height_px; ++r) {
    for (int c = 0; c < k.width_px; ++c) {
      const Vec3 ray = scene.world_T_camera.R * Vec3{(c - k.cx_px) / k.fx_px, (r - k.cy_px) / k.fy_px, 1.0};
      const double behind_m = eye_m.x() + ray.x() * (stairs.rise_m - eye_m.z()) / ray.z() - stairs.first_riser_x_m;
      if (behind_m < 0.0 || behind_m > 0.07) continue;
      picture
          .depth_m[static_cast<std::size_t>(r) * static_cast<std::size_t>(k.width_px) + static_cast<std::size_t>(c)] =
          0.0;
      rows += c == k.width_px / 2 ? 1 : 0;
    }
  }
  return rows;
}

TEST_P(StairNoise, WideStripWithoutDepth_TreadKeepsItsNosing) {
  StairSpec stairs;
  stairs.rise_m = 0.165;
  const DepthScene scene = stair_scene(stairs);
  DepthPicture picture = test::render(scene);
  test::add_noise(picture, {.correlated = GetParam()}, 5);
  const int rows = blank_first_nosing(scene, stairs, picture);
  EXPECT_GT(rows, 28);
  EXPECT_LT(rows, 40);
  Extraction extraction;
  const SurfaceFrame* frame = extraction.run_raw(scene, picture.raw());
  ASSERT_NE(frame, nullptr);
  const SurfacePatch* tread = tread_at(*frame, scene, stairs.rise_m);
  ASSERT_NE(tread, nullptr);
  ASSERT_TRUE(tread->nosing.valid);
  EXPECT_LT(line_error_m(scene, tread->nosing, stairs.first_riser_x_m), 0.004);
}

INSTANTIATE_TEST_SUITE_P(WhiteAndCorrelated, StairNoise, ::testing::Bool());

TEST(SurfaceExtractor, Dropouts_OneToThirtyPercent_LoseNoTread) {
  const StairSpec stairs;
  const DepthScene scene = stair_scene(stairs);
  Extraction extraction;
  for (const bool correlated : {false, true}) {
    for (const double dropout : {0.01, 0.05, 0.3}) {
      const SurfaceFrame& frame = extraction.run(scene, {.correlated = correlated, .dropout = dropout}, 3);
      for (int k = 1; k <= 2; ++k) {
        const SurfacePatch* tread = tread_at(frame, scene, k * stairs.rise_m);
        ASSERT_NE(tread, nullptr) << dropout << " tread " << k;
        EXPECT_LT(line_error_m(scene, tread->nosing, stairs.first_riser_x_m + (k - 1) * stairs.tread_m), 0.004);
      }
      EXPECT_GE(frame.invalid_fraction, 0.0);
      if (correlated) {
        EXPECT_NEAR(frame.invalid_fraction, dropout, 0.5 * dropout + 0.02);
      }
    }
  }
}

TEST(SurfaceExtractor, StepOfFortyMillimetres_StaysApartFromTheFloor) {
  StairSpec stairs;
  stairs.steps = 1;
  stairs.rise_m = 0.04;
  const DepthScene scene = stair_scene(stairs);
  Extraction extraction;
  for (const bool correlated : {false, true}) {
    const SurfaceFrame& frame = extraction.run(scene, {.correlated = correlated}, 5);
    EXPECT_FALSE(pieces_at(frame, scene, 0.0).empty());  // before and beside the step
    const SurfacePatch* step = tread_at(frame, scene, 0.04);
    ASSERT_NE(step, nullptr);
    EXPECT_TRUE(step->nosing.valid);
    EXPECT_LT(line_error_m(scene, step->nosing, stairs.first_riser_x_m), 0.005);
  }
}

TEST(SurfaceExtractor, Polygon_OfANarrowStaircase_EndsWhereTheTreadEnds) {
  StairSpec stairs;
  stairs.width_m = 0.6;
  const DepthScene scene = stair_scene(stairs);
  Extraction extraction;
  std::vector<double> sides_m;  // outwards
  std::uint32_t seed = 6;
  for (const bool correlated : {false, true}) {
    for (const double strength : {1.0, 2.0}) {
      double area_m2 = 0.0;
      constexpr int kFrames = 4;
      for (int i = 0; i < kFrames; ++i) {
        const SurfaceFrame& frame = extraction.run(scene, {.correlated = correlated, .strength = strength}, ++seed);
        expect_well_formed(frame);
        for (int k = 1; k <= 2; ++k) {
          SCOPED_TRACE(testing::Message() << "correlated " << correlated << " strength " << strength << " tread " << k);
          const SurfacePatch* tread = tread_at(frame, scene, k * stairs.rise_m);
          ASSERT_NE(tread, nullptr);
          double left = -1e9, right = 1e9, front = 1e9, rear = -1e9;
          for (const Vec3& p : tread->polygon) {
            const Vec3 w = scene.world_T_camera * p;
            left = std::max(left, w.y());
            right = std::min(right, w.y());
            front = std::min(front, w.x());
            rear = std::max(rear, w.x());
          }
          const double front_m = stairs.first_riser_x_m + (k - 1) * stairs.tread_m;
          EXPECT_NEAR(left, 0.3, 0.004);
          EXPECT_NEAR(right, -0.3, 0.004);
          if (!correlated) {
            EXPECT_NEAR(front, front_m, 0.003 * strength);
            EXPECT_NEAR(rear, front_m + stairs.tread_m, 0.003 * strength);
          }
          sides_m.insert(sides_m.end(), {left - 0.3, -0.3 - right});
          area_m2 += 0.5 / kFrames * tread->area_m2;
          for (std::size_t e = 0; !correlated && e < tread->polygon.size(); ++e) {
            EXPECT_EQ(tread->edges[e], EdgeKind::kObserved) << e;
          }
        }
      }
      // Neither shrunk nor grown, by half a percent; a back line is not always found in that much correlated noise.
      if (correlated && strength > 1.0) continue;
      EXPECT_NEAR(area_m2, 0.6 * 0.28, 0.005 * 0.6 * 0.28) << correlated << " " << strength;
    }
  }
  std::sort(sides_m.begin(), sides_m.end());
  EXPECT_NEAR(sides_m[sides_m.size() / 2], 0.0, 0.001);
}

// Whether the polygon holds what lies at a place of the world, seen from above.
bool holds(const SurfacePatch& patch, const DepthScene& scene, double x_m, double y_m) {
  const std::size_t n = patch.polygon.size();
  const auto side = [&](std::size_t i) {
    const Vec3 a = scene.world_T_camera * patch.polygon[i], b = scene.world_T_camera * patch.polygon[(i + 1) % n];
    return (b.x() - a.x()) * (y_m - a.y()) - (b.y() - a.y()) * (x_m - a.x());
  };
  for (std::size_t i = 0; i < n; ++i) {
    if (side(i) < 0.0) return false;
  }
  return n >= 3;
}

TEST(SurfaceExtractor, FloorAroundAStaircase_LiesBeforeTheFirstRiserAndNotUnderTheSteps) {
  for (const double width_m : {0.6, 0.9, 1.2}) {
    for (const double yaw_rad : {-0.2, 0.1}) {
      SCOPED_TRACE(testing::Message() << "width " << width_m << " yaw " << yaw_rad);
      StairSpec stairs;
      stairs.width_m = width_m;
      stairs.first_riser_x_m = 0.5;
      const DepthScene scene = stair_scene(stairs, yaw_rad);
      Extraction extraction;
      const SurfaceFrame& frame = extraction.run(scene, {}, 31);
      expect_well_formed(frame);
      int before = 0;
      for (const SurfacePatch& patch : frame.surfaces) {
        if (std::abs((scene.world_T_camera * patch.centroid_m).z()) > 0.02) continue;
        before += holds(patch, scene, 0.45, 0.0) ? 1 : 0;
        for (const double y_m : {-0.25, 0.0, 0.25}) EXPECT_FALSE(holds(patch, scene, 0.6, y_m)) << y_m;
      }
      EXPECT_EQ(before, 1);
    }
  }
}

TEST(SurfaceExtractor, LandingAroundAStairwell_IsConvexPiecesThatDoNotCoverTheHole) {
  DepthScene scene;
  scene.intrinsics = robot_camera_intrinsics();
  scene.place_camera(0.97, 1.047, 0.05, 0.01);
  scene.boxes = {{{-1.0, -1.5, 0.0}, {0.45, 1.5, 0.2}}, {{0.45, 0.0, 0.0}, {2.0, 1.5, 0.2}}};
  Extraction extraction;
  const SurfaceFrame& frame = extraction.run(scene, {}, 32);
  expect_well_formed(frame);
  const auto landing = pieces_at(frame, scene, 0.2);
  EXPECT_GE(landing.size(), 2U);
  int before = 0, beside = 0;
  for (const SurfacePatch* piece : landing) {
    EXPECT_EQ(piece->plane, landing.front()->plane);
    EXPECT_FALSE(holds(*piece, scene, 0.65, -0.15)) << "the hole lies deeper";
    before += holds(*piece, scene, 0.35, -0.15) ? 1 : 0;
    beside += holds(*piece, scene, 0.65, 0.2) ? 1 : 0;
  }
  EXPECT_EQ(before, 1);
  EXPECT_EQ(beside, 1);
}

TEST(SurfaceExtractor, OverhangingNosings_AreNoLeaningPlanes) {
  const auto leaning = [](bool split, double nosing_m, bool correlated) {
    SurfaceExtractor::Params params;
    if (!split) params.planes.overhangs.most_lean_rad = 0.0;
    Extraction extraction(params);
    StairSpec stairs;
    stairs.nosing_m = nosing_m;
    int count = 0;
    for (std::uint32_t seed = 41; seed < 44; ++seed) {
      const DepthScene scene = stair_scene(stairs, 0.02 * seed - 0.9);
      for (const SurfacePatch& patch : extraction.run(scene, {.correlated = correlated}, seed).surfaces) {
        const double up = std::abs(patch.normal.dot(scene.camera_up()));
        count += up > 0.1 && up < 0.9 ? 1 : 0;
      }
    }
    return count;
  };
  int without = 0;
  for (const double nosing_m : {0.02, 0.03, 0.04}) {
    for (const bool correlated : {false, true}) {
      SCOPED_TRACE(testing::Message() << nosing_m << " correlated " << correlated);
      EXPECT_EQ(leaning(true, nosing_m, correlated), 0);
      without += leaning(false, nosing_m, correlated);
    }
  }
  EXPECT_GT(without, 2) << "the scenes no longer show the fault";
}

TEST(SurfaceExtractor, RiserSeenNearlyEdgeOn_EndsAtTheTreads) {
  StairSpec stairs;
  stairs.first_riser_x_m = 0.05;
  const DepthScene scene = stair_scene(stairs);
  Extraction extraction;
  int risers = 0;
  for (const SurfacePatch& patch : extraction.run(scene, {.correlated = true}, 11).surfaces) {
    if (patch.kind != SurfaceKind::kRiser) continue;
    ++risers;
    double low_m = 1e9, high_m = -1e9;
    for (const Vec3& p : patch.polygon) {
      const double z_m = (scene.world_T_camera * p).z();
      low_m = std::min(low_m, z_m);
      high_m = std::max(high_m, z_m);
    }
    EXPECT_LT(high_m - low_m, stairs.rise_m + 0.015);
  }
  EXPECT_GE(risers, 2);
}

TEST(SurfaceExtractor, Polygon_CutByThePicture_SaysUnknownThere) {
  StairSpec stairs;
  stairs.width_m = 6.0;
  const DepthScene scene = stair_scene(stairs);
  Extraction extraction;
  const SurfaceFrame& frame = extraction.run(scene, {}, 8);
  const SurfacePatch* tread = tread_at(frame, scene, stairs.rise_m);
  ASSERT_NE(tread, nullptr);
  int sides = 0, ends = 0;
  const std::size_t n = tread->polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 a = scene.world_T_camera * tread->polygon[i], b = scene.world_T_camera * tread->polygon[(i + 1) % n];
    if ((b - a).norm() < 0.05) continue;
    if (std::abs(a.x() - b.x()) < 0.03) {  // along the stairs' width
      EXPECT_EQ(tread->edges[i], EdgeKind::kObserved);
      ++ends;
    } else {
      EXPECT_EQ(tread->edges[i], EdgeKind::kUnknown);
      ++sides;
    }
  }
  EXPECT_GE(ends, 2);
  EXPECT_GE(sides, 2);
  // The floor's near edge is the picture's: no nosing there.
  const SurfacePatch* floor = tread_at(frame, scene, 0.0);
  ASSERT_NE(floor, nullptr);
  EXPECT_FALSE(floor->nosing.valid);
  EXPECT_TRUE(floor->back.valid);
}

DepthScene scene_with_legs() {
  StairSpec stairs;
  stairs.first_riser_x_m = 0.25;
  DepthScene scene = stair_scene(stairs, 0.0, kCameraPitch_rad);
  // The left leg swings up, the right one stands under the hip.
  LegVector swing = LegVector::Zero(), stance = LegVector::Zero();
  swing[kHipPitch] = -1.15;
  swing[kKnee] = 1.5;
  swing[kAnklePitch] = -0.35;
  stance[kHipPitch] = -0.45;
  stance[kKnee] = 0.9;
  stance[kAnklePitch] = -0.45;
  const Transform camera_T_base = base_T_camera().inverse();
  scene.legs = {transformed(camera_T_base, base_leg_shapes({}, Foot::kLeft, swing)),
                transformed(camera_T_base, base_leg_shapes({}, Foot::kRight, stance))};
  return scene;
}

// Surfaces with at least a tenth of their pixels on the legs.
int surfaces_on_legs(const SurfaceExtractor& stage, const DepthScene& scene) {
  DepthScene bare = scene;
  bare.legs = {};
  const DepthPicture with = test::render(scene), without = test::render(bare);
  std::vector<int> all(kMaxPlanesPerFrame + 1, 0), on(kMaxPlanesPerFrame + 1, 0);
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < kHalfWidth_px; ++c) {
      const std::size_t s = stage.surface_at(2 * c, 2 * r);
      const auto i = static_cast<std::size_t>(2 * r * kDepthWidth_px + 2 * c);
      ++all[s];
      on[s] += with.depth_m[i] < without.depth_m[i] - 0.01 ? 1 : 0;
    }
  }
  int count = 0;
  for (std::size_t s = 1; s < all.size(); ++s) count += 10 * on[s] > all[s] && all[s] > 0 ? 1 : 0;
  return count;
}

TEST(SurfaceExtractor, OwnLegs_WithTheSelfFilter_AreNoSurfaces_WithoutItTheyAre) {
  const DepthScene scene = scene_with_legs();
  Extraction extraction;
  const SurfaceFrame filtered = extraction.run(scene, {}, 9);
  EXPECT_EQ(surfaces_on_legs(extraction.stage(), scene), 0);
  EXPECT_TRUE(extraction.stage().body_at(100, 200) || extraction.stage().body_at(220, 200));
  // The tread behind the knee is one surface, with its nosing.
  const SurfacePatch* tread = tread_at(filtered, scene, 0.15);
  ASSERT_NE(tread, nullptr);
  ASSERT_TRUE(tread->nosing.valid);
  EXPECT_LT(line_error_m(scene, tread->nosing, 0.25), 0.004);
  static_cast<void>(extraction.run(scene, {}, 9, false));
  EXPECT_GT(surfaces_on_legs(extraction.stage(), scene), 0);
}

TEST(SurfaceExtractor, TreadSplitByALeg_IsOneSurface) {
  StairSpec stairs;
  DepthScene scene = stair_scene(stairs);
  // An upright bar in front of the stairs, known to be the robot's own.
  const Transform camera_T_world = scene.world_T_camera.inverse();
  scene.legs[0].shank = {camera_T_world * Vec3{0.25, 0.0, 0.5}, camera_T_world * Vec3{0.55, 0.0, 0.1}, 0.05};
  Extraction extraction;
  const SurfaceFrame& frame = extraction.run(scene, {.correlated = true}, 10);
  for (int k = 1; k <= 2; ++k) {
    const SurfacePatch* tread = tread_at(frame, scene, k * stairs.rise_m);
    ASSERT_NE(tread, nullptr) << k;
    EXPECT_LT(line_error_m(scene, tread->nosing, stairs.first_riser_x_m + (k - 1) * stairs.tread_m), 0.004);
  }
}

TEST(SurfaceExtractor, PlatformsWithAGapBetween_StayTwoSurfaces) {
  DepthScene scene = stair_scene({.steps = 0});
  scene.boxes.push_back({{0.3, 0.08, 0.0}, {1.0, 0.6, 0.15}});
  scene.boxes.push_back({{0.3, -0.6, 0.0}, {1.0, -0.08, 0.15}});
  Extraction extraction;
  const SurfaceFrame& frame = extraction.run(scene, {}, 11);
  int platforms = 0;
  for (const SurfacePatch& s : frame.surfaces) {
    if (s.kind != SurfaceKind::kTread || std::abs((scene.world_T_camera * s.centroid_m).z() - 0.15) > 0.02) continue;
    ++platforms;
    double nearest = 1e9;
    for (const Vec3& p : s.polygon) nearest = std::min(nearest, std::abs((scene.world_T_camera * p).y()));
    EXPECT_NEAR(nearest, 0.08, 0.01);
  }
  EXPECT_EQ(platforms, 2);
}

// Two platforms, 0.2 m deep, this far apart: how many planes they count as.
std::size_t planes_of_platforms(double gap_m, double width_m = 0.16, double other_height_m = 0.15) {
  DepthScene scene = stair_scene({.steps = 0});
  scene.boxes.push_back({{0.4, 0.5 * gap_m, 0.0}, {0.6, 0.5 * gap_m + width_m, 0.15}});
  scene.boxes.push_back({{0.4, -0.5 * gap_m - width_m, 0.0}, {0.6, -0.5 * gap_m, other_height_m}});
  Extraction extraction;
  const SurfaceFrame& frame = extraction.run(scene, {}, 12);
  std::set<std::uint8_t> planes;
  int platforms = 0;
  for (const SurfacePatch& s : frame.surfaces) {
    if (s.kind != SurfaceKind::kTread || std::abs((scene.world_T_camera * s.centroid_m).z() - 0.15) > 0.03) continue;
    planes.insert(s.plane);
    ++platforms;
  }
  EXPECT_EQ(platforms, 2);
  return planes.size();
}

TEST(SurfaceExtractor, CoplanarPlatforms_FartherApartThanTheyAreWide_AreTwoPlanes) {
  EXPECT_EQ(planes_of_platforms(0.08), 1U);
  EXPECT_EQ(planes_of_platforms(0.30), 2U);
  EXPECT_EQ(planes_of_platforms(0.40, 2.0), 1U) << "both leave the picture";
}

TEST(SurfaceExtractor, NearPlatforms_ApartByMoreThanTheNoise_AreTwoPlanes) {
  EXPECT_EQ(planes_of_platforms(0.08, 0.16, 0.161), 2U);
}

// A platform on the floor, in which of every ten rows these lie 50 mm nearer. Segments pass over two such rows.
bool finds_striped_platform(const std::set<int>& stripes) {
  DepthScene scene = stair_scene({.steps = 0});
  const DepthPicture floor = test::render(scene);
  scene.boxes.push_back({{0.35, -0.15, 0.0}, {0.65, 0.15, 0.15}});
  DepthPicture picture = test::render(scene);
  for (std::size_t i = 0; i < picture.depth_m.size(); ++i) {
    const bool on_platform = picture.depth_m[i] != floor.depth_m[i];
    if (on_platform && stripes.count(static_cast<int>(i / 640 % 10)) != 0) picture.depth_m[i] -= 0.05;
  }
  Extraction extraction;
  const SurfaceFrame* frame = extraction.run_raw(scene, picture.raw());
  EXPECT_NE(frame, nullptr);
  return frame != nullptr && tread_at(*frame, scene, 0.15) != nullptr;
}

TEST(SurfaceExtractor, SurfaceThatItsPlaneHardlyExplains_IsNone) {
  EXPECT_TRUE(finds_striped_platform({}));
  EXPECT_TRUE(finds_striped_platform({0}));
  EXPECT_FALSE(finds_striped_platform({1, 4, 7, 9}));
}

TEST(SurfaceExtractor, AnySlicing_GivesTheSameBitsAndHoldsItsBudget) {
  const DepthScene scene = scene_with_legs();
  DepthPicture picture = test::render(scene);
  test::add_noise(picture, {.correlated = true}, 12);
  const std::vector<std::uint16_t> raw = picture.raw();
  Extraction whole;
  const SurfaceFrame* expected = whole.run_raw(scene, raw);
  ASSERT_NE(expected, nullptr);
  EXPECT_LE(whole.stage().units_spent(), SurfaceExtractor::kMaxUnitsPerFrame);

  auto sliced = std::make_unique<SurfaceExtractor>();
  std::mt19937 random(13);
  for (int trial = 0; trial < 3; ++trial) {
    if (trial > 0) expected = whole.run_raw(scene, raw);  // by now it knows how noisy the pictures are
    SurfaceExtractor::View view;
    view.intrinsics = scene.intrinsics;
    view.camera_up = rotation_z(0.006) * rotation_x(0.006) * scene.camera_up();
    view.body = scene.legs;
    ASSERT_TRUE(sliced->try_begin({trial + 1, 1, 640, 480, raw.data()}, view));
    Progress progress = Progress::kBusy;
    while (progress == Progress::kBusy) {
      WorkBudget budget(std::uniform_int_distribution<>(1, trial == 0 ? 3 : 400)(random));
      progress = sliced->step(budget);
      EXPECT_GT(budget.left(), -SurfaceExtractor::kMaxPieceUnits);
    }
    EXPECT_EQ(progress, Progress::kDone);
    const SurfaceFrame& got = sliced->result();
    ASSERT_EQ(got.surfaces.size(), expected->surfaces.size());
    for (std::size_t i = 0; i < got.surfaces.size(); ++i) {
      const SurfacePatch &a = got.surfaces[i], &b = expected->surfaces[i];
      EXPECT_EQ(a.normal, b.normal);
      EXPECT_EQ(a.d_m, b.d_m);
      EXPECT_EQ(a.offset_sigma_m, b.offset_sigma_m);
      EXPECT_EQ(a.rmse_m, b.rmse_m);
      EXPECT_EQ(a.nosing.a_m, b.nosing.a_m);
      EXPECT_EQ(a.back.b_m, b.back.b_m);
      ASSERT_EQ(a.polygon.size(), b.polygon.size());
      for (std::size_t k = 0; k < a.polygon.size(); ++k) EXPECT_EQ(a.polygon[k], b.polygon[k]);
      EXPECT_EQ(a.edges, b.edges);
    }
    WorkBudget more(10);
    EXPECT_EQ(sliced->step(more), Progress::kIdle);
  }
}

TEST(SurfaceExtractor, BadFrames_AreRefusedWithTheirReason) {
  const DepthScene scene = stair_scene({});
  const std::vector<std::uint16_t> raw(640 * 480, 3200);
  auto stage = std::make_unique<SurfaceExtractor>();
  SurfaceExtractor::View view;
  view.intrinsics = scene.intrinsics;
  view.camera_up = scene.camera_up();
  const DepthFrameView good{10, 1, 640, 480, raw.data()};

  EXPECT_FALSE(stage->try_begin({10, 1, 640, 480, nullptr}, view));
  EXPECT_FALSE(stage->try_begin({10, 1, 320, 240, raw.data()}, view));
  EXPECT_FALSE(stage->try_begin({10, 1, 640, 479, raw.data()}, view));
  EXPECT_EQ(stage->counters().bad_frame, 3U);

  SurfaceExtractor::View bad = view;
  bad.camera_up = Vec3::Zero();
  EXPECT_FALSE(stage->try_begin(good, bad));
  bad.camera_up = Vec3::Constant(std::nan(""));
  EXPECT_FALSE(stage->try_begin(good, bad));
  bad = view;
  bad.intrinsics.fx_px = 0.0;
  EXPECT_FALSE(stage->try_begin(good, bad));
  bad = view;
  bad.intrinsics.width_px = 1280;
  EXPECT_FALSE(stage->try_begin(good, bad));
  bad = view;
  bad.intrinsics.depth_unit_m = std::nan("");
  EXPECT_FALSE(stage->try_begin(good, bad));
  bad = view;
  bad.body[1].shank.a_m.x() = std::nan("");
  EXPECT_FALSE(stage->try_begin(good, bad));
  EXPECT_EQ(stage->counters().bad_view, 6U);

  ASSERT_TRUE(stage->try_begin(good, view));
  EXPECT_FALSE(stage->try_begin({11, 1, 640, 480, raw.data()}, view));
  EXPECT_EQ(stage->counters().busy, 1U);
  WorkBudget budget(1'000'000);
  ASSERT_EQ(stage->step(budget), Progress::kDone);
  EXPECT_FALSE(stage->try_begin(good, view));
  EXPECT_EQ(stage->counters().bad_order, 1U);
  EXPECT_EQ(stage->counters().frames, 1U);
}

TEST(SurfaceExtractor, BlankFrames_GiveAnEmptyResult) {
  const DepthScene scene = stair_scene({});
  Extraction extraction;
  for (const std::uint16_t value : {std::uint16_t{0}, std::uint16_t{65535}}) {
    const SurfaceFrame* frame = extraction.run_raw(scene, std::vector<std::uint16_t>(640 * 480, value));
    ASSERT_NE(frame, nullptr);
    EXPECT_TRUE(frame->surfaces.empty());
    EXPECT_EQ(frame->invalid_fraction, 1.0);
  }
  EXPECT_EQ(extraction.stage().counters().blank_frames, 2U);
}

TEST(SurfaceExtractor, RandomDepths_NeitherCrashNorLeaveTheirBudget) {
  const DepthScene scene = stair_scene({});
  Extraction extraction;
  std::mt19937 random(17);
  for (const int top : {65535, 8000, 3300}) {
    std::vector<std::uint16_t> raw(640 * 480);
    for (std::uint16_t& z : raw) z = static_cast<std::uint16_t>(std::uniform_int_distribution<>(3000, top)(random));
    const SurfaceFrame* frame = extraction.run_raw(scene, raw);
    ASSERT_NE(frame, nullptr);
    expect_well_formed(*frame);
    EXPECT_LE(extraction.stage().units_spent(), SurfaceExtractor::kMaxUnitsPerFrame);
  }
  // Stripes: as many regions and planes as fit.
  std::vector<std::uint16_t> raw(640 * 480);
  for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = static_cast<std::uint16_t>(2400 + 400 * ((i / 640 / 8) % 5));
  const SurfaceFrame* frame = extraction.run_raw(scene, raw);
  ASSERT_NE(frame, nullptr);
  expect_well_formed(*frame);
  EXPECT_LE(extraction.stage().units_spent(), SurfaceExtractor::kMaxUnitsPerFrame);
}

TEST(SurfaceExtractor, Memory_WholeStage_IsWhatTheDesignAllows) {
  EXPECT_LE(sizeof(SurfaceExtractor), std::size_t{3} * 1024 * 1024);
}

}  // namespace
}  // namespace polygmap
