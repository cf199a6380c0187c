// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/edge_lines.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "algorithms/perception/polygons/counter_random.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap {
namespace {

using Kind = EdgeLineFinder::Kind;

struct Bench {
  test::DepthScene scene;
  test::StairSpec stairs;
  using FullDepthImage = Raster<std::uint16_t, kDepthWidth_px, kDepthHeight_px>;
  std::unique_ptr<FullDepthImage> depth = std::make_unique<FullDepthImage>();
  std::unique_ptr<HalfImage<std::uint8_t>> flags = std::make_unique<HalfImage<std::uint8_t>>();
  std::unique_ptr<ColumnImage> columns = std::make_unique<ColumnImage>();
  ColumnRays rays;
  std::unique_ptr<EdgeLineFinder> finder = std::make_unique<EdgeLineFinder>();

  explicit Bench(double nosing_m, double yaw_rad = 0.05) {
    scene.intrinsics = robot_camera_intrinsics();
    scene.place_camera(0.77, 1.04, yaw_rad, 0.02);
    stairs.nosing_m = nosing_m;
    scene.add_stairs(stairs);
    rays.set(scene.intrinsics);
  }
  void draw(const test::NoiseSpec& noise, std::uint32_t seed) {
    test::DepthPicture picture = test::render(scene);
    test::add_noise(picture, noise, seed);
    const std::vector<std::uint16_t> raw = picture.raw();
    std::copy(raw.begin(), raw.end(), depth->data());
  }
  // No depth where a pixel's ray meets the first tread from x_m on, for a strip's width, or the front below its edge,
  // for a lip's height.
  void blank(double x_m, double strip_m, double lip_m) {
    const CameraIntrinsics& k = scene.intrinsics;
    const Vec3& eye_m = scene.world_T_camera.p_m;
    for (std::int32_t r = 0; r < k.height_px; ++r) {
      for (std::int32_t c = 0; c < k.width_px; ++c) {
        const Vec3 ray = scene.world_T_camera.R * Vec3{(c - k.cx_px) / k.fx_px, (r - k.cy_px) / k.fy_px, 1.0};
        const double on_tread_m = eye_m.x() + ray.x() * (stairs.rise_m - eye_m.z()) / ray.z();
        const double on_front_m = eye_m.z() + ray.z() * (x_m - eye_m.x()) / ray.x();
        const bool in_strip = ray.z() < 0.0 && on_tread_m >= x_m && on_tread_m < x_m + strip_m;
        const bool in_lip = ray.x() > 0.0 && on_front_m <= stairs.rise_m && on_front_m > stairs.rise_m - lip_m;
        if (in_strip || in_lip) (*depth)(c, r) = 0;
      }
    }
  }
  [[nodiscard]] InversePlane plane(const Vec3& world_normal, const Vec3& world_point) const {
    const Vec3 n = scene.world_T_camera.R.transpose() * world_normal;
    const double d = world_normal.dot(scene.world_T_camera.p_m - world_point);
    return {-n / d};
  }
  [[nodiscard]] InversePlane tread() const { return plane(Vec3::UnitZ(), {0, 0, stairs.rise_m}); }
  [[nodiscard]] InversePlane riser(int k) const {
    return plane(-Vec3::UnitX(), {stairs.first_riser_x_m + k * stairs.tread_m, 0, 0});
  }
  // Boundary rows of the world line (x, -0.5..0.5, z).
  void guess(double x_m, double z_m, double error_px) {
    const CameraIntrinsics& k = scene.intrinsics;
    finder->begin_guess();
    for (int i = 0; i < 2000; i += 5) {
      const Vec3 p = scene.world_T_camera.inverse() * Vec3{x_m, -0.5 + i / 2000.0, z_m};
      const double c = p.x() / p.z() * k.fx_px + k.cx_px, r = p.y() / p.z() * k.fy_px + k.cy_px;
      if (p.z() < 0.1 || c < 0 || c > 639 || r < 0 || r > 479) continue;
      finder->add_guess(static_cast<std::int32_t>(c) / kColumn_px, static_cast<std::int32_t>(r + error_px));
    }
  }
  // A block as high as a step, the robot on it, and the floor beyond.
  void stand_above(double edge_m) {
    scene.boxes = {{{-1.0, -0.6, 0.0}, {edge_m, 0.6, stairs.rise_m}}};
    scene.place_camera(1.2 + stairs.rise_m, 1.04, 0.05, 0.02);
  }
  EdgeLineFinder::Outcome find(const InversePlane* other, Kind kind, EdgeLine& line, double variance = 1e-6) {
    RawRange range;
    range.set({}, scene.intrinsics.depth_unit_m);
    for (std::int32_t r = 0; r < 480; ++r) {
      reduce_to_columns(range, depth->row(r), flags->row(r / 2), kColumns, columns->inverse_depth.row(r),
                        columns->valid.row(r));
    }
    if (!finder->try_guess({}, 1)) return EdgeLineFinder::Outcome::kNoLine;
    const Mat3 covariance = variance * Mat3::Identity();
    const EdgeLineFinder::Measured surface{tread(), covariance};
    const EdgeLineFinder::Measured beyond{other != nullptr ? *other : InversePlane{}, covariance};
    finder->begin({}, {}, scene.intrinsics, rays, *columns, surface, other != nullptr ? &beyond : nullptr, kind);
    EdgeLineFinder::Outcome outcome = EdgeLineFinder::Outcome::kAgain;
    for (int pass = 0; pass < 3 && outcome == EdgeLineFinder::Outcome::kAgain; ++pass) {
      while (!finder->step(48)) {
      }
      outcome = finder->finish(line);
    }
    return outcome;
  }
  // Worst distance along x of the line's ends from the true edge, m.
  [[nodiscard]] double error_m(const EdgeLine& line, double x_m) const {
    const Vec3 a = scene.world_T_camera * line.a_m, b = scene.world_T_camera * line.b_m;
    return std::max(std::abs(a.x() - x_m), std::abs(b.x() - x_m));
  }
};

class NosingNoise : public ::testing::TestWithParam<bool> {};

TEST_P(NosingNoise, EdgeLine_NosingAndBackLine_WithinThreePointOneMillimetres) {
  for (const double nosing_m : {0.0, 0.02}) {
    Bench bench(nosing_m);
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      bench.draw({.correlated = GetParam()}, seed);
      const InversePlane below = bench.riser(0), above = bench.riser(1);
      EdgeLine line;
      bench.guess(bench.stairs.first_riser_x_m - nosing_m, bench.stairs.rise_m, 2.0);
      ASSERT_EQ(bench.find(&below, Kind::kNosing, line), EdgeLineFinder::Outcome::kFound);
      EXPECT_TRUE(line.valid);
      EXPECT_LT(bench.error_m(line, bench.stairs.first_riser_x_m - nosing_m), 0.0031) << nosing_m << " " << seed;
      EXPECT_LT((line.b_m - line.a_m).norm(), 1.3);
      EXPECT_LT(std::abs(bench.tread().distance_m(line.a_m)), 1e-9);
      bench.guess(bench.stairs.first_riser_x_m + bench.stairs.tread_m, bench.stairs.rise_m, -2.0);
      ASSERT_EQ(bench.find(&above, Kind::kBack, line), EdgeLineFinder::Outcome::kFound);
      EXPECT_LT(bench.error_m(line, bench.stairs.first_riser_x_m + bench.stairs.tread_m), 0.003) << nosing_m;
    }
  }
}
// A strip along the nosing without depth: the riser still begins where it meets the tread's plane. The guess is there,
// or where the tread's depths end.
TEST_P(NosingNoise, StripWithoutDepth_RiserBelowIt_NosingWithinThreeMillimetres) {
  for (const double strip_m : {0.01, 0.02, 0.03, 0.04, 0.06}) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      Bench bench(0.0);
      const double edge_m = bench.stairs.first_riser_x_m;
      bench.draw({.correlated = GetParam()}, seed);
      bench.blank(edge_m, strip_m, 0.0);
      for (const double guess_m : {edge_m, edge_m + strip_m}) {
        const InversePlane below = bench.riser(0);
        EdgeLine line;
        bench.guess(guess_m, bench.stairs.rise_m, 0.0);
        ASSERT_EQ(bench.find(&below, Kind::kNosing, line), EdgeLineFinder::Outcome::kFound)
            << strip_m << " " << guess_m;
        EXPECT_LT(bench.error_m(line, edge_m), 0.003) << strip_m << " " << seed << " " << guess_m;
        EXPECT_LT(line.sigma_m, 0.003) << strip_m << " " << seed << " " << guess_m;
      }
    }
  }
}
// Without a riser to tell where it is, a lip lies in the gap that its strip leaves: in the outer half.
TEST_P(NosingNoise, LipWithAStripWithoutDepth_IsFoundInTheOuterHalfOfTheGap) {
  constexpr double kEdge_m = 0.5;
  for (const double strip_m : {0.0, 0.015, 0.03, 0.05}) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      Bench bench(0.0);
      bench.stand_above(kEdge_m);
      bench.draw({.correlated = GetParam()}, seed);
      bench.blank(kEdge_m - strip_m, strip_m, 0.0);
      const InversePlane floor = bench.plane(Vec3::UnitZ(), Vec3::Zero());
      EdgeLine line;
      bench.guess(kEdge_m - strip_m, bench.stairs.rise_m, 0.0);
      ASSERT_EQ(bench.find(&floor, Kind::kLip, line), EdgeLineFinder::Outcome::kFound) << strip_m << " " << seed;
      EXPECT_LT(bench.error_m(line, kEdge_m), 0.004 + 0.3 * strip_m) << strip_m << " " << seed;
      EXPECT_LT(bench.error_m(line, kEdge_m), 3.0 * line.sigma_m) << strip_m << " " << seed;
    }
  }
}
// Where the strip reaches over the front, nothing says how far: its back edge is not believed.
TEST_P(NosingNoise, StripOverTheFront_RiserBeginsLower_SigmaCoversTheError) {
  for (const double lip_m : {0.02, 0.03}) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      Bench bench(0.0);
      const double edge_m = bench.stairs.first_riser_x_m;
      bench.draw({.correlated = GetParam()}, seed);
      bench.blank(edge_m, 0.03, lip_m);
      const InversePlane below = bench.riser(0);
      EdgeLine line;
      bench.guess(edge_m, bench.stairs.rise_m, 0.0);
      ASSERT_EQ(bench.find(&below, Kind::kNosing, line), EdgeLineFinder::Outcome::kFound) << lip_m;
      EXPECT_LT(bench.error_m(line, edge_m), 2.0 * line.sigma_m) << lip_m << " " << seed;
      EXPECT_GT(line.sigma_m, 0.0025) << lip_m << " " << seed;
    }
  }
}
// A riser that is set back meets the tread's plane on the strip, where the tread goes on: the front below it says.
TEST_P(NosingNoise, StripOnAnOverhang_FrontBelowIt_NosingWithinThreePointFiveMillimetres) {
  for (const double nosing_m : {0.02, 0.03}) {
    for (const double strip_m : {0.01, 0.02, 0.03}) {
      for (std::uint32_t seed = 1; seed <= 3; ++seed) {
        Bench bench(nosing_m);
        const double edge_m = bench.stairs.first_riser_x_m - nosing_m;
        bench.draw({.correlated = GetParam()}, seed);
        bench.blank(edge_m, strip_m, 0.0);
        const InversePlane below = bench.riser(0);
        EdgeLine line;
        bench.guess(edge_m, bench.stairs.rise_m, 0.0);
        ASSERT_EQ(bench.find(&below, Kind::kNosing, line), EdgeLineFinder::Outcome::kFound)
            << nosing_m << " " << strip_m;
        EXPECT_LT(bench.error_m(line, edge_m), 0.0035) << nosing_m << " " << strip_m << " " << seed;
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(WhiteAndCorrelated, NosingNoise, ::testing::Bool());

// A camera's slow errors put a plane's best fit where its pixels beside the edge are not.
TEST(EdgeLineFinderTest, RiserFittedAside_PixelsBesideTheEdgeSayWhereItIs) {
  Bench bench(0.0);
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    bench.draw({.correlated = false}, seed);
    for (const double aside_m : {-0.001, 0.001}) {
      const InversePlane below = bench.plane(-Vec3::UnitX(), {bench.stairs.first_riser_x_m + aside_m, 0, 0});
      EdgeLine line;
      bench.guess(bench.stairs.first_riser_x_m, bench.stairs.rise_m, 2.0);
      ASSERT_EQ(bench.find(&below, Kind::kNosing, line, 1e-5), EdgeLineFinder::Outcome::kFound);
      EXPECT_LT(bench.error_m(line, bench.stairs.first_riser_x_m), 0.0008) << seed << " " << aside_m;
    }
  }
}

TEST(EdgeLineFinderTest, NoPlaneBeyond_DepthJumpIsFound) {
  // Without the riser in front, the floor shows below the slab's edge.
  Bench bench(0.0, 0.0);
  bench.scene.boxes.clear();
  bench.scene.boxes.push_back({{0.3, -0.6, 0.12}, {0.8, 0.6, 0.15}});
  bench.draw({}, 4);
  bench.guess(0.3, 0.15, 0.0);
  EdgeLine line;
  ASSERT_EQ(bench.find(nullptr, Kind::kNosing, line), EdgeLineFinder::Outcome::kFound);
  EXPECT_LT(bench.error_m(line, 0.3), 0.005);
}

TEST(EdgeLineFinderTest, ColumnsHiddenByTheBody_AreLeftOut) {
  Bench bench(0.0);
  bench.draw({}, 5);
  // Where the body is, the picture lies: something 5 cm nearer with an edge elsewhere.
  for (std::int32_t r = 0; r < 480; ++r) {
    for (std::int32_t c = 200; c < 420; ++c) {
      (*bench.depth)(c, r) = static_cast<std::uint16_t>((*bench.depth)(c, r) - (r > 300 ? 200 : 100));
      (*bench.flags)(c / 2, r / 2) = kPixelBody;
    }
  }
  const InversePlane below = bench.riser(0);
  bench.guess(bench.stairs.first_riser_x_m, bench.stairs.rise_m, 0.0);
  EdgeLine line;
  ASSERT_EQ(bench.find(&below, Kind::kNosing, line), EdgeLineFinder::Outcome::kFound);
  EXPECT_LT(bench.error_m(line, bench.stairs.first_riser_x_m), 0.003);
  EXPECT_LT(bench.finder->column_count(), 115);
  // All hidden: no line.
  bench.flags->fill(kPixelBody);
  EXPECT_EQ(bench.find(&below, Kind::kNosing, line), EdgeLineFinder::Outcome::kFewColumns);
  EXPECT_FALSE(line.valid);
}

TEST(EdgeLineFinderTest, NoEdgeInThePicture_GivesNone) {
  Bench bench(0.0);
  bench.scene.boxes.clear();
  bench.scene.boxes.push_back({{-1, -3, 0}, {3, 3, 0.15}});  // one endless tread
  bench.draw({}, 6);
  const InversePlane below = bench.riser(0);
  bench.guess(bench.stairs.first_riser_x_m, bench.stairs.rise_m, 0.0);
  EdgeLine line;
  EXPECT_NE(bench.find(&below, Kind::kNosing, line), EdgeLineFinder::Outcome::kFound);
  EXPECT_FALSE(line.valid);
}

TEST(EdgeLineFinderTest, ScatteredGuesses_AreRefused) {
  EdgeLineFinder finder;
  finder.begin_guess();
  for (std::int32_t i = 0; i < kColumns; ++i) {
    finder.add_guess(i, static_cast<std::int32_t>(counter_random(3, static_cast<std::uint32_t>(i)) % 480));
  }
  EXPECT_FALSE(finder.try_guess({}, 1));
  finder.begin_guess();
  EXPECT_FALSE(finder.try_guess({}, 1));
}

}  // namespace
}  // namespace polygmap
