// SPDX-License-Identifier: Apache-2.0
// Footholds over a lip: what comes next lies below.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "algorithms/foothold/foothold_search.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/seen_stairs.hpp"

namespace polygmap {
namespace {

constexpr std::int64_t kSeenAt_ns = 5 * kNsPerS;
constexpr double kLip_x_m = 0.24, kLowerTread_m = 0.28, kHalfWidth_m = 0.5;

MapPolygon surface_at(std::uint32_t id, double z_m, double from_x_m, double to_x_m, bool drops) {
  MapPolygon p;
  p.id = id;
  p.sightings = 100;
  p.last_seen_ns = kSeenAt_ns;
  p.surface.kind = SurfaceKind::kTread;
  p.surface.d_m = -z_m;
  p.surface.area_m2 = (to_x_m - from_x_m) * 2 * kHalfWidth_m;
  for (const Vec2& v :
       {Vec2{from_x_m, -kHalfWidth_m}, {to_x_m, -kHalfWidth_m}, {to_x_m, kHalfWidth_m}, {from_x_m, kHalfWidth_m}}) {
    EXPECT_TRUE(p.surface.polygon.try_push_back({v.x(), v.y(), z_m}));
  }
  const PolygonVertices& v = p.surface.polygon;
  p.surface.centroid_m = 0.25 * (v[0] + v[1] + v[2] + v[3]);
  p.surface.back = {v[2], v[1], 0.001, drops};
  p.surface.back_drops = drops;
  return p;
}

// A platform, a tread below it whose first `hidden_m` the lip hides, and the floor below that.
MapSnapshot platform_map(double drop_m, double hidden_m = 0.01) {
  MapSnapshot map;
  map.stamp_ns = kSeenAt_ns;
  const double next_x_m = kLip_x_m + kLowerTread_m;
  EXPECT_TRUE(map.polygons.try_push_back(surface_at(1, 0.0, -1.0, kLip_x_m, true)));
  EXPECT_TRUE(map.polygons.try_push_back(surface_at(2, -drop_m, kLip_x_m + hidden_m, next_x_m, true)));
  EXPECT_TRUE(map.polygons.try_push_back(surface_at(3, -2 * drop_m, next_x_m + hidden_m, 2.0, false)));
  return map;
}

FootholdSearch::Query before_lip(bool descends = true) {
  FootholdSearch::Query q;
  q.odom_T_base = test::base_above({0, 0, 0}, 0.0);
  q.odom_T_sole = test::soles_at({0, 0, 0}, 0.0);
  q.descends = descends;
  return q;
}

class FootholdSearchDown : public ::testing::Test {
 protected:
  const FootholdSet& search(const MapSnapshot& map, const FootholdSearch::Query& query) {
    search_->begin(map, query);
    WorkBudget budget(1 << 30);
    EXPECT_EQ(search_->step(budget), Progress::kDone);
    return search_->result();
  }
  std::unique_ptr<FootholdSearch> search_ =
      std::make_unique<FootholdSearch>(FootholdSearch::Params{}, nominal_robot().sole);
};

TEST_F(FootholdSearchDown, LipAhead_BothFeetLieOnTheTreadBelow) {
  const FootholdSet& r = search(platform_map(0.13), before_lip());
  ASSERT_EQ(r.obstruction, StopReason::kNone) << name_of(r.obstruction);
  ASSERT_TRUE(r.has_p_star);
  EXPECT_NEAR(r.measured_rise_m, -0.13, 1e-9);
  EXPECT_NEAR(r.measured_tread_m, kLowerTread_m, 1e-9);
  EXPECT_NEAR(r.tread.nosing_a_m.x(), kLip_x_m, 1e-9);
  for (const Foothold& f : r.p_star_feet) {
    EXPECT_EQ(f.polygon_id, 2U);
    EXPECT_NEAR(f.position_m.z(), -0.13, 1e-9);
    EXPECT_NEAR(f.yaw_rad, 0.0, 1e-9);
    EXPECT_GT(f.position_m.x() + kCollisionRectangle.heel_x_m - kLip_x_m, 0.005) << "no heel at the riser";
    EXPECT_GT(kLip_x_m + kLowerTread_m - f.position_m.x() - kContactRectangle.toe_x_m, 0.005)
        << "no toe over the next lip";
  }
}

TEST_F(FootholdSearchDown, TreadBelowDropsOn_ItsLipIsTold) {
  EXPECT_FALSE(FootholdSet{}.has_lip_beyond);
  const FootholdSet& r = search(platform_map(0.13), before_lip());
  ASSERT_TRUE(r.has_lip_beyond);
  EXPECT_NEAR(r.lip_beyond.nosing_a_m.x(), kLip_x_m + kLowerTread_m, 1e-9);
  EXPECT_GT(r.lip_beyond.nosing_a_m.y(), r.lip_beyond.nosing_b_m.y()) << "the left end first";

  MapSnapshot floor = platform_map(0.13);
  floor.polygons[1].surface.back_drops = false;
  EXPECT_FALSE(search(floor, before_lip()).has_lip_beyond);
}

TEST_F(FootholdSearchDown, DownIsNoWay_NothingIsOffered) {
  const FootholdSet& r = search(platform_map(0.13), before_lip(false));
  EXPECT_FALSE(r.has_p_star);
  EXPECT_EQ(r.obstruction, StopReason::kNoStaircase);
}

TEST_F(FootholdSearchDown, LowerThanALegReaches_IsSaidWithItsDepth) {
  const FootholdSet& r = search(platform_map(0.3), before_lip());
  EXPECT_FALSE(r.has_p_star);
  EXPECT_EQ(r.obstruction, StopReason::kDropTooDeep);
  EXPECT_NEAR(r.measured_rise_m, -0.3, 1e-9);
}

TEST_F(FootholdSearchDown, HeelOnWhatTheLipHides_IsUncertainUntilItIsNearer) {
  const FootholdSet& r = search(platform_map(0.13, 0.06), before_lip());
  EXPECT_FALSE(r.has_p_star);
  EXPECT_EQ(r.obstruction, StopReason::kEdgeUncertain);
}

// What lies a tread farther on is no next step.
TEST_F(FootholdSearchDown, TreadThatWasNotSeen_IsNotSteppedOver) {
  MapSnapshot map = platform_map(0.08);
  map.polygons[1] = map.polygons[2];
  ASSERT_TRUE(map.polygons.try_pop_back());
  const FootholdSet& r = search(map, before_lip());
  EXPECT_FALSE(r.has_p_star);
  EXPECT_NE(r.obstruction, StopReason::kNone);
}

TEST_F(FootholdSearchDown, HigherTreadBeforeTheLip_UpComesFirst) {
  MapSnapshot map = platform_map(0.13);
  MapPolygon higher = surface_at(4, 0.13, 0.15, 0.45, false);
  higher.surface.nosing = {higher.surface.polygon[3], higher.surface.polygon[0], 0.001, true};
  EXPECT_TRUE(map.polygons.try_push_back(higher));
  const FootholdSet& r = search(map, before_lip());
  EXPECT_GT(r.measured_rise_m, 0.0);
}

// A corner of it was merged from what lies elsewhere, as in a climb down of 2026-12-01.
TEST_F(FootholdSearchDown, MapOfTheTreadBehindReachesAhead_TheWayGoesDownAllTheSame) {
  MapSnapshot map = platform_map(0.13);
  MapPolygon behind = surface_at(4, 0.13, -0.5, -0.2, false);
  behind.surface.polygon[1] = {0.2, -0.4, 0.13};
  EXPECT_TRUE(map.polygons.try_push_back(behind));
  const FootholdSet& r = search(map, before_lip());
  ASSERT_EQ(r.obstruction, StopReason::kNone) << name_of(r.obstruction);
  EXPECT_NEAR(r.measured_rise_m, -0.13, 1e-9);
}

TEST_F(FootholdSearchDown, TreadTooShortForTheFoot_IsSaidWithItsDepth) {
  MapSnapshot map = platform_map(0.13);
  map.polygons[1] = surface_at(2, -0.13, kLip_x_m + 0.01, kLip_x_m + 0.23, true);
  const FootholdSet& r = search(map, before_lip());
  EXPECT_EQ(r.obstruction, StopReason::kTreadTooShort);
  EXPECT_NEAR(r.measured_tread_m, 0.23, 1e-9);
}

// Its nosing is seen, as on open stairs, and no shin leans over it.
TEST_F(FootholdSearchDown, HigherTreadBehind_IsNoRiseAheadOfTheFeet) {
  MapSnapshot map = platform_map(0.13);
  const double alone_m = search(map, before_lip()).p_star_feet[0].position_m.x();
  MapPolygon higher = surface_at(4, 0.13, -1.3, -0.3, true);
  higher.surface.nosing = {higher.surface.polygon[3], higher.surface.polygon[0], 0.001, true};
  EXPECT_TRUE(map.polygons.try_push_back(higher));
  const FootholdSet& r = search(map, before_lip());
  ASSERT_EQ(r.obstruction, StopReason::kNone) << name_of(r.obstruction);
  EXPECT_NEAR(r.p_star_feet[0].position_m.x(), alone_m, 1e-9);
}

TEST_F(FootholdSearchDown, WedgeBelow_BothHeelsKeepTheirMarginAndTheirWayFromTheLipIsTold) {
  constexpr double kDeep_m = 0.33, kSlant_m = 0.10;  // 0.2 rad between its two edges
  MapSnapshot map = platform_map(0.13);
  SurfacePatch& wedge = map.polygons[1].surface;
  wedge.polygon[1].x() = kLip_x_m + kDeep_m + kSlant_m;
  wedge.polygon[2].x() = kLip_x_m + kDeep_m - kSlant_m;
  wedge.back = {wedge.polygon[2], wedge.polygon[1], 0.001, true};
  const FootholdSet& r = search(map, before_lip());
  ASSERT_EQ(r.obstruction, StopReason::kNone) << name_of(r.obstruction);
  for (const Foothold& f : r.p_star_feet) {
    EXPECT_GT(f.yaw_rad, 0.05) << "between the headings of its edges";
    const Transform odom_T_sole{rotation_z(f.yaw_rad), f.position_m};
    for (const double side : {-1.0, 1.0}) {
      const Vec3 heel_m = odom_T_sole * Vec3{kCollisionRectangle.heel_x_m, side * kCollisionRectangle.half_width_m, 0};
      EXPECT_GT(heel_m.x() - kLip_x_m, FootholdSearch::Params{}.margin.of(0.001));
    }
    EXPECT_NEAR(f.nosing_distance_m, (f.position_m.x() - kLip_x_m) / std::cos(f.yaw_rad), 1e-6);
  }
}

}  // namespace
}  // namespace polygmap
