// SPDX-License-Identifier: Apache-2.0
#include "algorithms/foothold/foothold_search.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "algorithms/foothold/reach.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/seen_stairs.hpp"

namespace polygmap {
namespace {

using test::Stairs;

constexpr std::int64_t kNow_ns = 5 * kNsPerS;

// An ideal map: the stairs as they are, everything confirmed, up to a tread (0: none) in front of the robot.
MapPolygon level(std::uint32_t id, const Transform& world_T_stairs, double z_m, double x0, double x1, double half_m,
                 bool nosing, bool back) {
  MapPolygon p;
  p.id = id;
  p.sightings = 100;
  p.last_seen_ns = kNow_ns;
  p.surface.kind = SurfaceKind::kTread;
  p.surface.d_m = -(world_T_stairs.p_m.z() + z_m);
  p.surface.area_m2 = (x1 - x0) * 2 * half_m;
  for (const Vec2& v : {Vec2{x0, -half_m}, {x1, -half_m}, {x1, half_m}, {x0, half_m}}) {
    EXPECT_TRUE(p.surface.polygon.try_push_back(world_T_stairs * Vec3{v.x(), v.y(), z_m}));
  }
  const PolygonVertices& v = p.surface.polygon;
  p.surface.centroid_m = 0.25 * (v[0] + v[1] + v[2] + v[3]);
  p.surface.nosing = {v[3], v[0], 0.001, nosing};
  p.surface.back = {v[2], v[1], 0.001, back};
  return p;
}

MapPolygon riser(std::uint32_t id, const Transform& world_T_stairs, double x_m, double z0, double z1, double half_m) {
  MapPolygon p;
  p.id = id;
  p.sightings = 100;
  p.last_seen_ns = kNow_ns;
  p.surface.kind = SurfaceKind::kRiser;
  p.surface.normal = world_T_stairs.R * Vec3{-1, 0, 0};
  p.surface.area_m2 = (z1 - z0) * 2 * half_m;
  for (const Vec2& v : {Vec2{half_m, z0}, {-half_m, z0}, {-half_m, z1}, {half_m, z1}}) {
    EXPECT_TRUE(p.surface.polygon.try_push_back(world_T_stairs * Vec3{x_m, v.x(), v.y()}));
  }
  p.surface.centroid_m = world_T_stairs * Vec3{x_m, 0, 0.5 * (z0 + z1)};
  p.surface.d_m = -p.surface.normal.dot(p.surface.centroid_m);
  return p;
}

MapSnapshot ideal_map(const Stairs& s) {
  MapSnapshot map;
  map.stamp_ns = kNow_ns;
  const Transform T = s.world_T_stairs();
  const auto missing = [&](int step) { return std::find(s.missing.begin(), s.missing.end(), step) != s.missing.end(); };
  std::uint32_t id = 1;
  EXPECT_TRUE(
      map.polygons.try_push_back(level(id++, T, 0, -1.5, missing(1) ? s.tread_m : 0.0, 1.0, false, s.steps > 0)));
  for (int k = 1; k <= s.steps; ++k) {
    if (missing(k)) continue;
    const double foot = (k - (missing(k - 1) ? 2 : 1)) * s.rise_m;
    const double back = missing(k + 1) ? s.back_x_m(k + 1) : s.back_x_m(k);
    EXPECT_TRUE(map.polygons.try_push_back(
        level(id++, T, k * s.rise_m, s.nosing_x_m(k), back, 0.5 * s.width_m, true, k < s.steps)));
    EXPECT_TRUE(map.polygons.try_push_back(riser(id++, T, (k - 1) * s.tread_m, foot, k * s.rise_m, 0.5 * s.width_m)));
  }
  return map;
}

const double kRound_m = FootholdSearch::Params{}.feet.nosing_round_m;  // of each nosing carries no heel

// Both feet on tread `on` (0: the floor, that far before the first riser), robot heading off by yaw.
FootholdSearch::Query standing(const Stairs& s, int on, double before_m = 0.3, double lateral_m = 0.0,
                               double yaw_rad = 0.0) {
  const double x = on == 0 ? -before_m : s.nosing_x_m(on) + 0.0872;
  const Vec3 middle = s.world_T_stairs() * Vec3{x, lateral_m, on * s.rise_m};
  FootholdSearch::Query q;
  q.odom_T_base = test::base_above(middle, s.yaw_rad + yaw_rad);
  q.odom_T_sole = test::soles_at(middle, s.yaw_rad + yaw_rad);
  q.climbing = on > 0;
  return q;
}

class FootholdSearchTest : public ::testing::Test {
 protected:
  const FootholdSet& search(const MapSnapshot& map, const FootholdSearch::Query& query, std::int32_t units = 1 << 20) {
    search_->begin(map, query);
    for (int i = 0; i < 100000; ++i) {
      WorkBudget budget(units);
      if (search_->step(budget) != Progress::kBusy) break;
    }
    return search_->result();
  }
  const FootholdSet& search(const Stairs& s, int on) { return search(ideal_map(s), standing(s, on)); }

  // Both feet lie on tread k as the design wants them.
  void expect_feet_on(const FootholdSet& r, const Stairs& s, int k) {
    ASSERT_EQ(r.obstruction, StopReason::kNone);
    ASSERT_TRUE(r.has_p_star);
    const Transform stairs_T_world = s.world_T_stairs().inverse();
    const double nosing = s.nosing_x_m(k);
    // The next riser is nosing_m further back than the next nosing, which the toe must also miss.
    const double toe_end = k < s.steps ? s.nosing_x_m(k + 1) : 1e9;
    for (const Foothold& f : r.p_star_feet) {
      const Vec3 p = stairs_T_world * f.position_m;
      EXPECT_NEAR(p.z(), k * s.rise_m, 1e-9);
      EXPECT_NEAR(math::wrap_angle(f.yaw_rad - s.yaw_rad), 0.0, 1e-9);
      const double heel = p.x() + kContactRectangle.heel_x_m - nosing;
      const double toe = toe_end - (p.x() + kCollisionRectangle.toe_x_m);
      EXPECT_GT(heel, 0.005);
      EXPECT_GT(toe, 0.005);
      if (k < s.steps && s.tread_m < 0.3) {
        if (s.rise_m < FootholdSearch::Params{}.feet.high_rise_m) {
          EXPECT_NEAR(heel - kRound_m, toe, 1e-6) << "centred";
        } else {
          EXPECT_LT(heel + 0.005, toe) << "the shin has room";
        }
      }
      EXPECT_NEAR(f.nosing_distance_m, p.x() - nosing, 1e-9);
      EXPECT_LE(std::abs(p.y()) + kContactRectangle.half_width_m + 0.02, 0.5 * s.width_m + 1e-9);
    }
    EXPECT_GT((r.p_star_feet[0].position_m - r.p_star_feet[1].position_m).norm(), 0.17 - 1e-9);
    EXPECT_NEAR(r.measured_rise_m, k * s.rise_m - (k - 1) * s.rise_m, 1e-9);
    if (k < s.steps) {
      EXPECT_NEAR(r.measured_tread_m, s.tread_m, 1e-9);
    }
  }

  std::unique_ptr<FootholdSearch> search_ =
      std::make_unique<FootholdSearch>(FootholdSearch::Params{}, nominal_robot().sole);
};

// ---- the equations one by one

LevelSurface prepared(const MapPolygon& polygon) {
  LevelSurface out;
  EXPECT_TRUE(prepare(polygon, 0.0, LevelSurfaceParams{}, EdgeMargin{}, kSole, out));
  return out;
}

TEST(FootholdSearchEq14To16, TiltedTread_BecomesItsPlanViewHullAndBox) {
  MapPolygon p = level(1, {}, 0.13, 0, 0.28, 0.6, true, true);
  p.surface.polygon[1].z() += 0.01;
  EXPECT_TRUE(p.surface.polygon.try_push_back({0.1, 0.1, 0.5}));  // inside in plan: not of the hull
  const LevelSurface s = prepared(p);
  EXPECT_EQ(s.hull.size(), 4U);
  EXPECT_EQ(s.box.min_m, Vec2(0, -0.6));
  EXPECT_EQ(s.box.max_m, Vec2(0.28, 0.6));
}

TEST(FootholdSearchEq17To19, RasterOfATurnedTread_HasExactlyTheCellsInside) {
  const auto raster = std::make_unique<FootholdRaster>();
  const LevelSurface s = prepared(level(1, {rotation_z(0.3), Vec3{0.2, 0.1, 0}}, 0.13, 0, 0.28, 0.5, true, true));
  raster->centre_on({0.2, 0.1}, 0.01);
  int inside = 0;
  for (std::int32_t row = 0; row < FootholdRaster::kSide; ++row) {
    raster->clear_row(row);
    raster->add_row(row, {&s, 1}, 0);
    for (std::int32_t column = 0; column < FootholdRaster::kSide; ++column) {
      const bool in = signed_distance_m(s.hull, raster->at(column, row)) >= 0.0;
      EXPECT_EQ(raster->layer(column, row), in ? 0 : FootholdRaster::kNoLayer);
      inside += in ? 1 : 0;
    }
  }
  EXPECT_NEAR(inside * 1e-4, 0.28 * 1.0, 0.02);
}

TEST(FootholdSearchEq18, CellHeight_IsTheVertexMeanOnALevelTreadAndThePlaneOnATiltedOne) {
  MapPolygon p = level(1, {}, 0.13, -0.2, 0.2, 0.2, true, true);
  double mean_z = 0.0;
  for (const Vec3& v : p.surface.polygon) mean_z += 0.25 * v.z();
  EXPECT_NEAR(prepared(p).plane.height_m({0.0, 0.0}), mean_z, 1e-6);
  p.surface.normal = Vec3{0.02, 0, 1}.normalized();
  p.surface.d_m = -p.surface.normal.dot(Vec3{0, 0, 0.13});
  EXPECT_NEAR(prepared(p).plane.height_m({0.15, 0.0}), 0.13 - 0.02 * 0.15, 1e-6);
}

TEST(FootholdSearchEq20, RangeFilter_LimitsAheadAndAsideOfTheTurnedBase) {
  const Transform base{rotation_z(kPi / 2), Vec3{1, 1, 0.8}};
  EXPECT_NEAR((PlanFrame(base)({1, 2}) - Vec2(1, 0)).norm(), 0, 1e-12);
  EXPECT_TRUE(in_range({1.2, -1.2}, 1.2));
  EXPECT_FALSE(in_range({1.21, 0}, 1.2));
  EXPECT_FALSE(in_range({0, -1.21}, 1.2));
}

TEST(FootholdSearchEq21, OverlappingSurfaces_TheHighestStays) {
  const auto raster = std::make_unique<FootholdRaster>();
  raster->centre_on({0, 0}, 0.01);
  raster->clear_row(80);
  const std::array<LevelSurface, 2> surfaces{prepared(level(2, {}, 0.0, -0.5, 0.2, 0.2, false, true)),
                                             prepared(level(1, {}, 0.13, -0.1, 0.3, 0.2, true, true))};
  raster->add_row(80, surfaces, 1);
  raster->add_row(80, surfaces, 0);
  EXPECT_EQ(raster->layer(80, 80), 1);
  EXPECT_EQ(raster->layer(60, 80), 0);
}

TEST(FootholdSearchEq22And23, HeightLimit_CountsFromTheLowestPointOfTheStandingFoot) {
  const Transform sole{rotation_y(0.1), Vec3{0, 0, 0.5}};  // toes down
  EXPECT_NEAR(z_foot_m(kSole, sole), 0.5 - 0.17084 * std::sin(0.1), 1e-12);
  EXPECT_TRUE(below_limit(0.9, 0.5, 0.4));
  EXPECT_FALSE(below_limit(0.901, 0.5, 0.4));
}

TEST(FootholdSearchEq24And25, Clearance_AgainstSampledContactRectangle_Agrees) {
  std::mt19937 random(25);
  std::uniform_real_distribution<> u(-0.5, 0.5);
  for (int trial = 0; trial < 500; ++trial) {
    const double yaw = 2 * kPi * u(random);
    const LevelSurface s =
        prepared(level(1, {rotation_z(yaw), Vec3{u(random), u(random), 0}}, 0.13, 0, 0.28, 0.4, true, true));
    const Vec2 p = s.at(0.14 + 0.3 * u(random), u(random));
    const Transform sole{rotation_z(s.yaw_rad), Vec3{p.x(), p.y(), 0.13}};
    double sampled = 1e9;
    for (const Vec3& corner : sole_contacts_m()) {
      for (std::size_t i = 0; i < s.hull.size(); ++i) {
        sampled = std::min(sampled, edge_half_plane(s.hull, i).distance_m((sole * corner).head<2>()));
      }
    }
    EXPECT_NEAR(s.contact_clearance_m(p), sampled, 1e-12);
    const Vec3 toe = sole * Vec3{kCollisionRectangle.toe_x_m, 0, 0};
    EXPECT_NEAR(s.toe_clearance_m(p), 0.28 - s.along_m(toe.head<2>()), 1e-12);
  }
}

TEST_F(FootholdSearchTest, Eq25_ErodedTreadOf280mm_KeepsCellsAndNoFootHangsOver) {
  // 13 erosions by a 1 cm pixel leave nothing of this tread.
  const Stairs s{.yaw_rad = 0.1};
  const FootholdSet& r = search(s, 0);
  ASSERT_TRUE(r.has_p_star);
  for (const Foothold& f : r.p_star_feet) EXPECT_GT(f.clearance_m, 0.010);
}

TEST_F(FootholdSearchTest, Eq26_PStar_IsOnTheNearestHigherTreadAndPStarStarOnTheNext) {
  const Stairs s{};
  for (int on = 0; on <= 2; ++on) {
    const FootholdSet& r = search(s, on);
    ASSERT_TRUE(r.has_p_star && r.has_p_star_star) << on;
    EXPECT_NEAR(r.p_star.position_m.z(), (on + 1) * s.rise_m, 1e-9);
    EXPECT_NEAR(r.p_star.position_m.x(), s.nosing_x_m(on + 1) + 0.0872, 0.001);
    const Foothold& beyond = r.p_star_star_feet[0];
    EXPECT_NEAR(beyond.position_m.z(), (on + 2) * s.rise_m, 1e-9);
    EXPECT_NEAR(beyond.position_m.x(), s.nosing_x_m(on + 2) + 0.0872, 0.001);
    EXPECT_NEAR(beyond.nosing_distance_m, 0.0872, 0.001);
    EXPECT_NE(beyond.polygon_id, r.p_star.polygon_id);
    EXPECT_EQ(r.p_star.polygon_id, r.p_star_feet[0].polygon_id);
  }
}

TEST_F(FootholdSearchTest, Eq26_PStarStarOfBothFeet_LieSideBySideOnTheTreadAfterTheNext) {
  const Stairs s{};
  MapSnapshot map = ideal_map(s);
  map.drift_m = {0.02, -0.01, 0.03};
  FootholdSearch::Query q = standing(s, 0);
  q.odom_T_base.p_m += map.drift_m;
  for (Transform& sole : q.odom_T_sole) sole.p_m += map.drift_m;
  const FootholdSet& r = search(map, q);
  ASSERT_TRUE(r.has_p_star_star);
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const Foothold& f = r.p_star_star_feet[index_of(foot)];
    EXPECT_NEAR(f.position_m.x(), s.nosing_x_m(2) + 0.0872 + map.drift_m.x(), 0.001);
    EXPECT_NEAR(f.position_m.z(), 2 * s.rise_m + map.drift_m.z(), 1e-9);
    EXPECT_NEAR(f.position_m.y(), r.p_star_feet[index_of(foot)].position_m.y(), 0.02);
    EXPECT_EQ(f.polygon_id, r.p_star_star_feet[0].polygon_id);
    EXPECT_GT(f.clearance_m, 0.010);
  }
}

TEST_F(FootholdSearchTest, SecondRiseTooHigh_IsNoPStarStar) {
  const Stairs s{};
  MapSnapshot map = ideal_map(s);
  for (MapPolygon& polygon : map.polygons) {
    const bool above = polygon.surface.kind == SurfaceKind::kTread && polygon.surface.centroid_m.z() > 1.5 * s.rise_m;
    if (!above) continue;
    polygon.surface.centroid_m.z() += 0.11;
    polygon.surface.d_m -= 0.11;
    for (Vec3& v : polygon.surface.polygon) v.z() += 0.11;
  }
  const FootholdSet& r = search(map, standing(s, 0));
  EXPECT_EQ(r.obstruction, StopReason::kNone);
  EXPECT_TRUE(r.has_p_star);
  EXPECT_FALSE(r.has_p_star_star);
}

TEST_F(FootholdSearchTest, SecondTreadTooShort_IsNoPStarStar) {
  const Stairs s{};
  constexpr double kShorter_m = 0.0205;  // 259.5 mm: the foot fits, by 3.75 mm at either end, but 260 mm are asked for
  MapSnapshot map = ideal_map(s);
  for (MapPolygon& polygon : map.polygons) {
    const double x_m = polygon.surface.centroid_m.x(), z_m = polygon.surface.centroid_m.z();
    const bool second = polygon.surface.kind == SurfaceKind::kTread && std::abs(z_m - 2 * s.rise_m) < 1e-9;
    const bool above = z_m > 2.2 * s.rise_m;
    for (Vec3& v : polygon.surface.polygon) {
      if (above || (second && v.x() > x_m)) v.x() -= kShorter_m;
    }
    if (second) {
      for (Vec3* p : {&polygon.surface.back.a_m, &polygon.surface.back.b_m}) p->x() -= kShorter_m;
    }
    polygon.surface.nosing.sigma_m = polygon.surface.back.sigma_m = 0.0;
    if (!above) continue;
    polygon.surface.centroid_m.x() -= kShorter_m;
    polygon.surface.d_m += kShorter_m * polygon.surface.normal.x();
    for (Vec3* p : {&polygon.surface.nosing.a_m, &polygon.surface.nosing.b_m}) p->x() -= kShorter_m;
    for (Vec3* p : {&polygon.surface.back.a_m, &polygon.surface.back.b_m}) p->x() -= kShorter_m;
  }
  const FootholdSet& r = search(map, standing(s, 0));
  EXPECT_EQ(r.obstruction, StopReason::kNone);
  EXPECT_TRUE(r.has_p_star);
  EXPECT_FALSE(r.has_p_star_star);
}

TEST_F(FootholdSearchTest, Eq26_SplitStance_SearchesFromTheFootThatStays) {
  const Stairs s{};
  FootholdSearch::Query q = standing(s, 1);
  q.odom_T_sole[index_of(Foot::kRight)].p_m = Vec3{s.nosing_x_m(2) + 0.0872, -0.1, 2 * s.rise_m};
  q.stance = Foot::kRight;
  EXPECT_NEAR(search(ideal_map(s), q).p_star.position_m.z(), 3 * s.rise_m, 1e-9);
  q.stance = Foot::kLeft;
  EXPECT_NEAR(search(ideal_map(s), q).p_star.position_m.z(), 2 * s.rise_m, 1e-9);
}

TEST(FootholdSearchEq28, SoleLayer_IsWithinDeltaFootOnBothSides) {
  EXPECT_TRUE(in_sole_layer(0.539, 0.5, 0.04));
  EXPECT_TRUE(in_sole_layer(0.461, 0.5, 0.04));
  EXPECT_FALSE(in_sole_layer(0.541, 0.5, 0.04));
  EXPECT_FALSE(in_sole_layer(0.459, 0.5, 0.04));
}

// ---- what stands on the treads

// A post of 40 mm on the floor or a tread, as the map knows it: its front.
MapPolygon post(std::uint32_t id, const Transform& world_T_stairs, double x_m, double y_m, double z_m) {
  MapPolygon p = riser(id, world_T_stairs, x_m, z_m, z_m + 0.9, 0.02);
  const Vec3 aside = world_T_stairs.R * Vec3{0, y_m, 0};
  for (Vec3& v : p.surface.polygon) v += aside;
  p.surface.centroid_m += aside;
  return p;
}

TEST_F(FootholdSearchTest, BalustersAlongBothEdges_FeetLieAsWithoutThem) {
  const Stairs s{.yaw_rad = 0.4, .origin_m = {1.0, -2.0, 0.0}};
  for (const int on : {0, 1, 2}) {
    MapSnapshot map = ideal_map(s);
    const FootholdSet without = search(map, standing(s, on));
    std::uint32_t id = 1000;
    for (double x_m = 0.05; x_m < 0.8; x_m += 0.11) {
      for (const double side : {1.0, -1.0}) {
        const double z_m = (1 + std::floor(x_m / s.tread_m)) * s.rise_m;
        ASSERT_TRUE(map.polygons.try_push_back(post(id++, s.world_T_stairs(), x_m, side * 0.4, z_m)));
      }
    }
    const FootholdSet& r = search(map, standing(s, on));
    ASSERT_EQ(r.obstruction, StopReason::kNone) << on;
    EXPECT_EQ(r.measured_tread_m, without.measured_tread_m);
    for (const std::size_t f : {0U, 1U}) {
      EXPECT_EQ(r.p_star_feet[f].position_m, without.p_star_feet[f].position_m);
      EXPECT_EQ(r.p_star_feet[f].toe_clearance_m, without.p_star_feet[f].toe_clearance_m);
    }
  }
}

TEST_F(FootholdSearchTest, PostAtTheSideOfTheFeet_TheyStandBesideIt) {
  const Stairs s;
  for (const double side : {1.0, -1.0}) {
    MapSnapshot map = ideal_map(s);
    const double y_m = side * 0.15;  // 18 mm of the outer foot's box would meet it
    ASSERT_TRUE(map.polygons.try_push_back(post(1000, s.world_T_stairs(), 0.12, y_m, s.rise_m)));
    const FootholdSet& r = search(map, standing(s, 0));
    ASSERT_EQ(r.obstruction, StopReason::kNone) << side;
    for (const Foothold& foot : r.p_star_feet) {
      const Vec3 p = s.world_T_stairs().inverse() * foot.position_m;
      EXPECT_GT(std::abs(p.y() - y_m), kCollisionRectangle.half_width_m + 0.02 + 0.019) << side;
      EXPECT_LT(side * p.y(), 0.15) << "not around it";
    }
  }
}

TEST_F(FootholdSearchTest, PostInTheMiddleOfATread_SaysThatSomethingStandsThere) {
  const Stairs s;
  MapSnapshot map = ideal_map(s);
  ASSERT_TRUE(map.polygons.try_push_back(post(1000, s.world_T_stairs(), 0.12, 0.0, s.rise_m)));
  EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kObstacle);
}

TEST_F(FootholdSearchTest, CubeWhereAFootWouldStand_SaysThatSomethingLiesThere) {
  const Stairs s;
  MapSnapshot map = ideal_map(s);
  for (const double y_m : {0.08, 0.10, 0.12}) {
    const Vec3 p = s.world_T_stairs() * Vec3{0.14, y_m, s.rise_m};
    ASSERT_TRUE(map.occupied.try_push_back({p.x(), p.y(), p.z(), 0.02}));
  }
  EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kObstacle);
}

TEST_F(FootholdSearchTest, CubeBetweenTheFeet_TheyStandAsWithoutIt) {
  const Stairs s;
  MapSnapshot map = ideal_map(s);
  const FootholdSet without = search(map, standing(s, 0));
  const Vec3 p = s.world_T_stairs() * Vec3{0.14, 0.0, s.rise_m};
  ASSERT_TRUE(map.occupied.try_push_back({p.x(), p.y(), p.z(), 0.02}));
  const FootholdSet& with = search(map, standing(s, 0));
  ASSERT_EQ(with.obstruction, StopReason::kNone);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    EXPECT_LT((with.p_star_feet[foot].position_m - without.p_star_feet[foot].position_m).norm(), 1e-9);
  }
}

TEST_F(FootholdSearchTest, FootThatStandsAheadOfWhereItIsTold_IsToldFartherBackOnBothTreads) {
  Stairs s;
  s.yaw_rad = 0.3;
  const MapSnapshot map = ideal_map(s);
  FootholdSearch::Query query = standing(s, 0);
  const FootholdSet without = search(map, query);
  query.feet_ahead_m = {0.003, -0.003};
  const FootholdSet& with = search(map, query);
  ASSERT_TRUE(with.has_p_star_star);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const Vec3 back_m = -query.feet_ahead_m[foot] * rotation_z(s.yaw_rad).col(0);
    EXPECT_LT((with.p_star_feet[foot].position_m - without.p_star_feet[foot].position_m - back_m).norm(), 1e-9);
    EXPECT_LT((with.p_star_star_feet[foot].position_m - without.p_star_star_feet[foot].position_m - back_m).norm(),
              1e-9);
    EXPECT_EQ(with.p_star_feet[foot].nosing_distance_m, without.p_star_feet[foot].nosing_distance_m);
  }
}

TEST_F(FootholdSearchTest, RobotThatGoesFartherThanItsLegsSay_IsToldNearerByAShareOfTheWay) {
  Stairs s;
  s.yaw_rad = 0.3;
  MapSnapshot map = ideal_map(s);
  map.drift_m = {0.4, 0.3, 0.1};
  FootholdSearch::Query query = standing(s, 0);
  query.odom_T_base.p_m += map.drift_m;
  for (Transform& sole : query.odom_T_sole) sole.p_m += map.drift_m;
  const FootholdSet without = search(map, query);
  query.way_excess = 0.01;
  const FootholdSet& with = search(map, query);
  ASSERT_TRUE(with.has_p_star_star);
  const Vec3 heading = rotation_z(s.yaw_rad).col(0);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    for (const auto feet : {&FootholdSet::p_star_feet, &FootholdSet::p_star_star_feet}) {
      const Foothold &told = (with.*feet)[foot], &before = (without.*feet)[foot];
      const double way_m =
          heading.dot(before.position_m - query.odom_T_base.p_m) + FootholdSearch::Params{}.feet.seen_behind_m;
      EXPECT_GT(way_m, 0.3);
      EXPECT_LT((told.position_m - before.position_m + 0.01 * way_m * heading).norm(), 1e-9);
      EXPECT_EQ(told.nosing_distance_m, before.nosing_distance_m);
    }
  }
}

TEST_F(FootholdSearchTest, CubeAtTheOuterSideOfAFoot_BothMoveAwayFromIt) {
  const Stairs s;
  MapSnapshot map = ideal_map(s);
  const Vec3 p = s.world_T_stairs() * Vec3{0.14, 0.15, s.rise_m};
  ASSERT_TRUE(map.occupied.try_push_back({p.x(), p.y(), p.z(), 0.02}));
  const FootholdSet& r = search(map, standing(s, 0));
  ASSERT_EQ(r.obstruction, StopReason::kNone);
  const Vec3 left = s.world_T_stairs().inverse() * r.p_star_feet[0].position_m;
  EXPECT_LT(left.y(), 0.15 - kCollisionRectangle.half_width_m - 0.019);
}

TEST_F(FootholdSearchTest, WallAcrossBothFeetAtASlant_SaysThatSomethingStandsThere) {
  const Stairs s;
  for (const double slant_rad : {0.7, -0.7, 1.0}) {
    MapSnapshot map = ideal_map(s);
    const Transform world_T_wall = s.world_T_stairs() * Transform{rotation_z(slant_rad), Vec3{0.15, 0.0, 0.0}};
    ASSERT_TRUE(map.polygons.try_push_back(riser(1000, world_T_wall, 0.0, s.rise_m, s.rise_m + 0.5, 0.6)));
    EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kObstacle) << slant_rad;
  }
}

TEST_F(FootholdSearchTest, PostBetweenTheRobotAndTheStairs_SaysThatSomethingStandsThere) {
  const Stairs s;
  MapSnapshot map = ideal_map(s);
  ASSERT_TRUE(map.polygons.try_push_back(post(1000, s.world_T_stairs(), -0.05, 0.0, 0.0)));
  EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kObstacle);
}

TEST_F(FootholdSearchTest, BoxOnTheTreadAtItsSide_ChangesNothing) {
  const Stairs s;
  MapSnapshot map = ideal_map(s);
  const FootholdSet without = search(map, standing(s, 0));
  const Transform world_T_box = s.world_T_stairs() * Transform{Mat3::Identity(), Vec3{0.0, 0.42, 0.0}};
  const double top_m = s.rise_m + 0.3;
  ASSERT_TRUE(map.polygons.try_push_back(level(1000, world_T_box, top_m, 0.1, 0.4, 0.15, true, false)));
  ASSERT_TRUE(map.polygons.try_push_back(riser(1001, world_T_box, 0.1, s.rise_m, top_m, 0.15)));
  const FootholdSet& r = search(map, standing(s, 0));
  ASSERT_EQ(r.obstruction, StopReason::kNone);
  EXPECT_EQ(r.measured_tread_m, without.measured_tread_m);
  EXPECT_EQ(r.p_star_feet[0].position_m, without.p_star_feet[0].position_m);
}

// ---- whole staircases

TEST_F(FootholdSearchTest, TreadsRisesYawsAndNosings_FeetLieCentredOnTheNextTread) {
  for (const double tread : {0.275, 0.28, 0.285, 0.30}) {
    for (const double rise : {0.10, 0.13, 0.17}) {
      for (const double yaw : {-0.17, 0.0, 0.17, 2.0}) {
        for (const double nosing : {0.0, 0.02}) {
          const Stairs s{
              .rise_m = rise, .tread_m = tread, .nosing_m = nosing, .yaw_rad = yaw, .origin_m = {1.003, -2.007, 0.3}};
          for (int on = 0; on < s.steps; ++on) {
            SCOPED_TRACE(::testing::Message() << tread << " " << rise << " " << yaw << " " << nosing << " on " << on);
            expect_feet_on(search(s, on), s, on + 1);
          }
        }
      }
    }
  }
}

TEST_F(FootholdSearchTest, RobotTurned10Degrees_TargetsStillFollowTheNosing) {
  const Stairs s{.yaw_rad = 0.4};
  for (const double yaw : {-0.175, 0.175}) {
    expect_feet_on(search(ideal_map(s), standing(s, 0, 0.5, 0.1, yaw)), s, 1);
  }
}

TEST_F(FootholdSearchTest, FirstRiser800mmAhead_IsFoundFromTheFloor) {
  const Stairs s{};
  expect_feet_on(search(ideal_map(s), standing(s, 0, 0.8, -0.15, 0.1)), s, 1);
}

double middle_y(const FootholdSet& r) {
  EXPECT_EQ(r.obstruction, StopReason::kNone);
  return 0.5 * (r.p_star_feet[0].position_m + r.p_star_feet[1].position_m).y();
}

TEST_F(FootholdSearchTest, SidesNotSeen_LateralPositionIsKeptUntilTheSideMarginStopsIt) {
  const Stairs s{.width_m = 0.8};
  MapSnapshot map = ideal_map(s);
  for (MapPolygon& polygon : map.polygons) polygon.surface.edges.fill(EdgeKind::kUnknown);
  EXPECT_NEAR(middle_y(search(map, standing(s, 1, 0, 0.07))), 0.07, 1e-9);
  EXPECT_NEAR(middle_y(search(map, standing(s, 1, 0, 0.4))), 0.4 - 0.1 - kContactRectangle.half_width_m - 0.02, 1e-9);
}

TEST_F(FootholdSearchTest, SidesSeen_FeetGoToTheMiddleAtOnceFromTheFloorAndSlowlyOnTheWayUp) {
  const Stairs s{.width_m = 0.8};
  EXPECT_NEAR(middle_y(search(ideal_map(s), standing(s, 0, 0.5, 0.07))), 0.0, 1e-9);
  EXPECT_NEAR(middle_y(search(ideal_map(s), standing(s, 1, 0, 0.07))), 0.07 - FootholdSearch::Params{}.feet.veer_max_m,
              1e-9);
}

TEST_F(FootholdSearchTest, NarrowTread_FeetCloseUpThenItSaysTooNarrowIfItsSidesWereSeen) {
  Stairs s{.width_m = 0.32};
  const FootholdSet& r = search(s, 1);
  ASSERT_EQ(r.obstruction, StopReason::kNone);
  const double spacing = (r.p_star_feet[0].position_m - r.p_star_feet[1].position_m).norm();
  EXPECT_GE(spacing, 0.17 - 1e-9);
  EXPECT_LE(0.5 * spacing + kContactRectangle.half_width_m + 0.02, 0.16 + 1e-9);
  s.width_m = 0.30;
  EXPECT_EQ(search(s, 1).obstruction, StopReason::kTooNarrow);
  EXPECT_FALSE(search_->result().has_p_star);
  MapSnapshot map = ideal_map(s);
  for (MapPolygon& p : map.polygons) p.surface.edges.fill(EdgeKind::kUnknown);  // a patch of sunlight on either side
  EXPECT_EQ(search(map, standing(s, 1)).obstruction, StopReason::kNothingSeen);
}

TEST_F(FootholdSearchTest, TreadEndsInNothing_ToeStaysOnItAsBeforeARiser) {
  const Stairs s{};
  MapSnapshot map = ideal_map(s), only;
  only.stamp_ns = kNow_ns;
  map.polygons[1].surface.back.valid = false;
  ASSERT_TRUE(only.polygons.try_push_back(map.polygons[0]) && only.polygons.try_push_back(map.polygons[1]));
  const FootholdSet& r = search(only, standing(s, 0));
  ASSERT_EQ(r.obstruction, StopReason::kNone);
  const double heel_m = r.p_star_feet[0].position_m.x() + kContactRectangle.heel_x_m;
  const double toe_m = s.tread_m - (r.p_star_feet[0].position_m.x() + kCollisionRectangle.toe_x_m);
  EXPECT_NEAR(heel_m - kRound_m, toe_m, 1e-9);
}

TEST_F(FootholdSearchTest, BackEdgeNotMapped_HeelGoes14mmAndHalfItsRoundBehindTheNosing) {
  const Stairs s{};
  MapSnapshot map = ideal_map(s), only;
  only.stamp_ns = kNow_ns;
  MapPolygon tread = map.polygons[1];
  tread.surface.back.valid = false;
  tread.surface.edges.fill(EdgeKind::kUnknown);
  ASSERT_TRUE(only.polygons.try_push_back(map.polygons[0]) && only.polygons.try_push_back(tread));
  const FootholdSet& r = search(only, standing(s, 0));
  ASSERT_EQ(r.obstruction, StopReason::kNone);
  EXPECT_NEAR(r.p_star_feet[0].position_m.x() + kContactRectangle.heel_x_m, 0.014 + 0.5 * kRound_m, 1e-9);
  EXPECT_EQ(r.measured_tread_m, 0.0);
  EXPECT_TRUE(std::isinf(r.p_star_feet[0].toe_clearance_m));
  EXPECT_FALSE(r.has_p_star_star);
}

// A landing, or a tread whose next riser nobody saw: it may end where what was seen of it does.
TEST_F(FootholdSearchTest, DeepSurfaceWithoutABackEdge_HeelGoesAsFarInAsOnADeepTread) {
  const Stairs s{};
  for (const double seen_to_m : {0.29, 0.30, 0.6}) {
    MapSnapshot map;
    map.stamp_ns = kNow_ns;
    ASSERT_TRUE(map.polygons.try_push_back(ideal_map(s).polygons[0]));
    ASSERT_TRUE(map.polygons.try_push_back(level(2, {}, 0.13, 0.0, seen_to_m, 0.6, true, false)));
    const FootholdSet& r = search(map, standing(s, 0));
    ASSERT_EQ(r.obstruction, StopReason::kNone);
    const double room_m = seen_to_m - kCollisionRectangle.toe_x_m + kContactRectangle.heel_x_m;
    EXPECT_NEAR(r.p_star_feet[0].position_m.x() + kContactRectangle.heel_x_m,
                std::min(0.5 * (room_m + kRound_m), FootholdSearch::Params{}.feet.heel_inset_max_m), 1e-9);
  }
}

// Of 3 degrees: it is higher ahead than the soles by more than what makes a level.
TEST_F(FootholdSearchTest, GroundUnderfootThatRises_IsNotTheNextTread) {
  MapSnapshot map;
  map.stamp_ns = kNow_ns;
  const Stairs s{};
  MapPolygon landing = level(1, {}, 0.0, -0.5, 1.5, 0.6, true, false);
  const double slope = 0.052;
  for (Vec3& v : landing.surface.polygon) v.z() = slope * (v.x() + 0.3);
  landing.surface.normal = Vec3{-slope, 0.0, 1.0}.normalized();
  landing.surface.d_m = -landing.surface.normal.dot(Vec3{-0.3, 0.0, 0.0});
  ASSERT_TRUE(map.polygons.try_push_back(landing));
  FootholdSearch::Query query = standing(s, 0);
  query.climbing = true;
  EXPECT_EQ(search(map, query).obstruction, StopReason::kTop);
}

// A strip without depth hides the nosing, and the riser below it measures 60 mm too tall.
TEST_F(FootholdSearchTest, TallRiserBeneathATreadWithoutANosing_IsNotTooHigh) {
  const Stairs s{};
  MapSnapshot map;
  map.stamp_ns = kNow_ns;
  ASSERT_TRUE(map.polygons.try_push_back(ideal_map(s).polygons[0]));
  ASSERT_TRUE(map.polygons.try_push_back(level(2, {}, 0.13, 0.06, 0.28, 0.6, false, false)));
  ASSERT_TRUE(map.polygons.try_push_back(riser(3, {}, 0.0, 0.0, 0.195, 0.6)));
  EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kNothingSeen);
}

TEST_F(FootholdSearchTest, TreadSeenOnlyInFront_NoFootholdReachesOverWhatWasSeen) {
  const Stairs s{};
  MapSnapshot map;
  map.stamp_ns = kNow_ns;
  ASSERT_TRUE(map.polygons.try_push_back(ideal_map(s).polygons[0]));
  ASSERT_TRUE(map.polygons.try_push_back(level(2, {}, 0.13, 0.0, 0.2, 0.6, true, false)));
  EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kNothingSeen);
  EXPECT_FALSE(search_->result().has_p_star);
}

TEST_F(FootholdSearchTest, StepMissing_SaysRiseTooHighAndPlacesNothing) {
  for (const double rise : {0.13, 0.17}) {
    for (int on = 0; on <= 2; ++on) {
      Stairs s{.rise_m = rise};
      s.missing = {on + 1};
      const FootholdSet& r = search(s, on);
      EXPECT_EQ(r.obstruction, StopReason::kRiseTooHigh) << rise << " " << on;
      EXPECT_NEAR(r.measured_rise_m, 2 * rise, 1e-9);
      EXPECT_FALSE(r.has_p_star);
      // Not seen at all, neither riser nor the longer tread in its place.
      MapSnapshot map;
      map.stamp_ns = kNow_ns;
      s.missing = {};
      for (const MapPolygon& p : ideal_map(s).polygons) {
        const bool gone =
            p.surface.kind == SurfaceKind::kRiser || std::abs(p.surface.centroid_m.z() - (on + 1) * rise) < 0.01;
        if (!gone) {
          EXPECT_TRUE(map.polygons.try_push_back(p));
        }
      }
      EXPECT_EQ(search(map, standing(s, on)).obstruction, StopReason::kRiseTooHigh);
      EXPECT_FALSE(search_->result().has_p_star);
    }
  }
}

TEST_F(FootholdSearchTest, StepOf200mm_IsClimbedWhereItsRiserWasSeenFarEnoughDown) {
  for (int on = 0; on <= 2; ++on) {
    const Stairs s{.rise_m = 0.2};
    expect_feet_on(search(s, on), s, on + 1);
    EXPECT_TRUE(search_->result().has_p_star_star);
    MapSnapshot open;
    open.stamp_ns = kNow_ns;
    for (const MapPolygon& p : ideal_map(s).polygons) {
      if (p.surface.kind == SurfaceKind::kTread) {
        EXPECT_TRUE(open.polygons.try_push_back(p));
      }
    }
    EXPECT_EQ(search(open, standing(s, on)).obstruction, StopReason::kRiseTooHigh);
  }
}

// The shin of the leg that lifts the body leans over the toe.
TEST_F(FootholdSearchTest, HighStairs_AreTooHighWhereTheirTreadsAreNotDeepEnough) {
  for (const double tread : {0.27, 0.28, 0.30, 0.32}) {
    for (const double rise : {0.18, 0.2, 0.21, 0.22}) {
      const Stairs s{.rise_m = rise, .tread_m = tread};
      const bool fits = rise < 0.19 || rise < 0.205 + 0.5 * (tread - 0.28);
      EXPECT_EQ(search(s, 1).obstruction, fits ? StopReason::kNone : StopReason::kRiseTooHigh) << rise << " " << tread;
    }
  }
  const Stairs curb{.steps = 1, .rise_m = 0.22};
  EXPECT_EQ(search(curb, 0).obstruction, StopReason::kNone);
}

TEST_F(FootholdSearchTest, TreadOfLowStairsNotSeen_IsNotSteppedOver) {
  for (const double rise : {0.10, 0.11, 0.115}) {
    for (int on = 0; on <= 2; ++on) {
      const Stairs s{.rise_m = rise};
      MapSnapshot map;
      map.stamp_ns = kNow_ns;
      for (const MapPolygon& p : ideal_map(s).polygons) {
        const double z_m = p.surface.centroid_m.z();
        const bool gone = std::abs(z_m - (on + 1) * rise) < 0.01 || std::abs(z_m - (on + 0.5) * rise) < 0.01;
        if (!gone) {
          EXPECT_TRUE(map.polygons.try_push_back(p));
        }
      }
      EXPECT_EQ(search(map, standing(s, on)).obstruction, StopReason::kRiseTooHigh) << rise << " " << on;
      EXPECT_NEAR(search_->result().measured_rise_m, 2 * rise, 1e-9);
      EXPECT_FALSE(search_->result().has_p_star);
    }
  }
}

TEST_F(FootholdSearchTest, NarrowTopWithNothingBehind_IsAStoolUnlessItsSidesWereNotSeen) {
  for (const double width : {0.36, 0.5, 0.6}) {
    const Stairs s{.steps = 1, .rise_m = 0.15, .width_m = width};
    MapSnapshot map = ideal_map(s);
    EXPECT_EQ(search(map, standing(s, 0)).obstruction, width < 0.55 ? StopReason::kTooNarrow : StopReason::kNone);
    for (MapPolygon& p : map.polygons) p.surface.edges.fill(EdgeKind::kUnknown);
    EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kNone);
  }
  const Stairs narrow{.rise_m = 0.15, .width_m = 0.5};
  expect_feet_on(search(narrow, 0), narrow, 1);
}

TEST_F(FootholdSearchTest, StepOf500mm_SaysRiseTooHighFromTheTreadOrFromItsFaceAlone) {
  const Stairs s{.steps = 1, .rise_m = 0.5};
  EXPECT_EQ(search(s, 0).obstruction, StopReason::kRiseTooHigh);
  EXPECT_NEAR(search_->result().measured_rise_m, 0.5, 1e-9);
  MapSnapshot face;
  face.stamp_ns = kNow_ns;
  ASSERT_TRUE(face.polygons.try_push_back(ideal_map(s).polygons[0]));
  ASSERT_TRUE(face.polygons.try_push_back(riser(2, {}, 0.0, 0.0, 0.4, 0.5)));
  EXPECT_EQ(search(face, standing(s, 0)).obstruction, StopReason::kRiseTooHigh);
  EXPECT_NEAR(search_->result().measured_rise_m, 0.4, 1e-9);
}

TEST_F(FootholdSearchTest, RiserMeasuredTooTall_TheTreadOnItDecides) {
  const Stairs s{.rise_m = 0.12};
  MapSnapshot map = ideal_map(s);
  map.polygons[2] = riser(map.polygons[2].id, {}, 0.0, 0.0, 0.21, 0.6);  // seen from close above
  EXPECT_EQ(search(map, standing(s, 0)).obstruction, StopReason::kNone);
  map.polygons[2] = riser(map.polygons[2].id, {}, -0.2, 0.0, 0.21, 0.6);  // stands before the first tread
  EXPECT_EQ(search(map, standing(s, 0, 0.5)).obstruction, StopReason::kRiseTooHigh);
}

TEST_F(FootholdSearchTest, TreadOf100mm_SaysTooShort) {
  const FootholdSet& r = search(Stairs{.tread_m = 0.1}, 0);
  EXPECT_EQ(r.obstruction, StopReason::kTreadTooShort);
  EXPECT_NEAR(r.measured_tread_m, 0.1, 1e-9);
  EXPECT_FALSE(r.has_p_star);
}

TEST_F(FootholdSearchTest, Landing_SaysTopOnlyWhenClimbingAndTheWayAheadWasSeen) {
  const Stairs s{.steps = 3};
  FootholdSearch::Query q = standing(s, 3);
  EXPECT_EQ(search(ideal_map(s), q).obstruction, StopReason::kTop);
  q.climbing = false;
  EXPECT_EQ(search(ideal_map(s), q).obstruction, StopReason::kNoStaircase);
  q.climbing = true;
  MapSnapshot blind = ideal_map(s);
  for (MapPolygon& p : blind.polygons) {
    if (std::abs(p.surface.centroid_m.z() - 3 * s.rise_m) < 0.01)
      p = level(99, {}, 3 * s.rise_m, 0.56, 0.70, 0.6, true, false);
  }
  EXPECT_EQ(search(blind, q).obstruction, StopReason::kNothingSeen);
}

// A landing shorter than the way that is looked at: where it was seen to end, nothing rises behind.
TEST_F(FootholdSearchTest, ShortLanding_SaysTopWhenItsEndWasSeen) {
  const Stairs s{.steps = 3};
  const FootholdSearch::Query q = standing(s, 3);
  for (const EdgeKind end : {EdgeKind::kObserved, EdgeKind::kUnknown}) {
    MapSnapshot map = ideal_map(s);
    for (MapPolygon& p : map.polygons) {
      if (std::abs(p.surface.centroid_m.z() - 3 * s.rise_m) > 0.01) continue;
      p = level(99, {}, 3 * s.rise_m, 0.56, 0.56 + 0.38, 0.6, true, false);
      p.surface.edges[1] = end;
    }
    const bool seen = end == EdgeKind::kObserved;
    EXPECT_EQ(search(map, q).obstruction, seen ? StopReason::kTop : StopReason::kNothingSeen);
  }
}

// What the map does not know well is given away from the clearance.
TEST_F(FootholdSearchTest, EdgesKnownVaguely_FootholdIsRefusedWithThatReason) {
  const Stairs s{.tread_m = 0.275};
  const auto with_sigma = [&](double sigma_m) {
    MapSnapshot map = ideal_map(s);
    for (MapPolygon& p : map.polygons) p.surface.nosing.sigma_m = p.surface.back.sigma_m = sigma_m;
    return map;
  };
  // 11.5 mm of room at either end: two sigmas of the edge and of the foot's 2.2 mm.
  EXPECT_EQ(search(with_sigma(0.0052), standing(s, 0)).obstruction, StopReason::kNone);
  EXPECT_EQ(search(with_sigma(0.0054), standing(s, 0)).obstruction, StopReason::kEdgeUncertain);
  EXPECT_FALSE(search_->result().has_p_star);
}

// A foot in the middle would be refused for the nosing alone, with room to spare behind.
TEST_F(FootholdSearchTest, NosingKnownWorseThanTheRiser_FootStandsFartherFromIt) {
  const Stairs s{.tread_m = 0.275};
  MapSnapshot map = ideal_map(s);
  const auto tread = std::find_if(map.polygons.begin(), map.polygons.end(), [&](const MapPolygon& p) {
    return p.surface.kind == SurfaceKind::kTread && std::abs(p.surface.centroid_m.z() - s.rise_m) < 0.01;
  });
  ASSERT_NE(tread, map.polygons.end());
  for (const auto& [nosing_m, back_m] : {std::pair{0.0060, 0.001}, std::pair{0.001, 0.0060}}) {
    tread->surface.nosing.sigma_m = nosing_m;
    tread->surface.back.sigma_m = back_m;
    const FootholdSet& r = search(map, standing(s, 0));
    EXPECT_EQ(r.obstruction, StopReason::kNone);
    const double more_m = 2.0 * (std::hypot(nosing_m, 0.0022) - std::hypot(back_m, 0.0022));
    for (const Foothold& foot : r.p_star_feet) {
      const double heel_m = foot.nosing_distance_m + kContactRectangle.heel_x_m;
      EXPECT_NEAR(heel_m - kRound_m - foot.toe_clearance_m, more_m, 1e-9);
    }
  }
}

TEST_F(FootholdSearchTest, EmptyOrUnconfirmedMap_NamesTheReason) {
  const Stairs s{};
  EXPECT_EQ(search(MapSnapshot{}, standing(s, 0)).obstruction, StopReason::kNothingSeen);
  MapSnapshot fresh = ideal_map(s);
  for (MapPolygon& p : fresh.polygons) p.sightings = p.id == 1 ? 100 : 4;
  EXPECT_EQ(search(fresh, standing(s, 0)).obstruction, StopReason::kNothingSeen);
  EXPECT_EQ(search(ideal_map({.steps = 0}), standing(s, 0)).obstruction, StopReason::kNoStaircase);
}

TEST_F(FootholdSearchTest, Slicing_DoesNotChangeTheResult) {
  const Stairs s{.yaw_rad = 0.13};
  const MapSnapshot map = ideal_map(s);
  const FootholdSet whole = search(map, standing(s, 1, 0, 0.03, 0.05));
  ASSERT_TRUE(whole.has_p_star && whole.has_p_star_star);
  for (const std::int32_t units : {1, 7, 100}) {
    const FootholdSet& sliced = search(map, standing(s, 1, 0, 0.03, 0.05), units);
    EXPECT_EQ(sliced.p_star.position_m, whole.p_star.position_m);
    EXPECT_EQ(sliced.p_star_star_feet[0].position_m, whole.p_star_star_feet[0].position_m);
    EXPECT_EQ(sliced.p_star_feet[1].position_m, whole.p_star_feet[1].position_m);
  }
}

TEST_F(FootholdSearchTest, Counters_EveryOneRises) {
  const Stairs s{};
  FootholdSearch::Query q = standing(s, 0);
  search(ideal_map(s), q);
  EXPECT_EQ(search_->counters().searches, 1U);
  search_->begin(ideal_map(s), q);
  search_->begin(ideal_map(s), q);
  EXPECT_EQ(search_->counters().abandoned, 1U);
  q.odom_T_base.p_m.x() = std::nan("");
  search_->begin(ideal_map(s), q);
  EXPECT_EQ(search_->counters().rejected_queries, 1U);
  WorkBudget budget(10);
  EXPECT_EQ(search_->step(budget), Progress::kIdle);
}

}  // namespace
}  // namespace polygmap
