// SPDX-License-Identifier: Apache-2.0
#include "algorithms/foothold/things_on_tread.hpp"

#include <gtest/gtest.h>

#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

constexpr double kHeight_m = 0.13, kDepth_m = 0.28;

class ThingsOnTreadTest : public ::testing::Test {
 protected:
  const SoleModel sole_{};
  const ThingParams params_{};
  LevelSurface tread_;
  OccupiedCells cells_;
  WorkCount work_;

  void SetUp() override { ASSERT_TRUE(prepare(tread(kHeight_m, 0.6), 0.0, {}, {}, sole_, tread_)); }
  static MapPolygon tread(double height_m, double half_m) {
    MapPolygon p;
    p.surface.kind = SurfaceKind::kTread;
    p.surface.d_m = -height_m;
    for (const Vec2& v : {Vec2{0.0, -half_m}, {kDepth_m, -half_m}, {kDepth_m, half_m}, {0.0, half_m}}) {
      EXPECT_TRUE(p.surface.polygon.try_push_back({v.x(), v.y(), height_m}));
    }
    p.surface.nosing = {p.surface.polygon[3], p.surface.polygon[0], 0.001, true};
    return p;
  }
  void occupy(double x_m, double y_m, double ground_m = kHeight_m, double height_m = 0.03) {
    EXPECT_TRUE(cells_.try_push_back({x_m, y_m, ground_m, height_m}));
  }
  void add() { add_things(cells_, params_, sole_, 0.0, 0.16, tread_, work_); }
};

TEST_F(ThingsOnTreadTest, CellOnTheTread_AFootMeetsItAndStandsBesideIt) {
  occupy(0.15, 0.1);
  add();
  ASSERT_EQ(tread_.obstacles.size(), 1U);
  const TreadObstacle& thing = tread_.obstacles[0];
  EXPECT_TRUE(thing.meets(0.1, 0.1));
  EXPECT_FALSE(thing.meets(-0.1, -0.1));
  EXPECT_FALSE(thing.meets(0.1 - sole_.collision.half_width_m - 0.03, 0.1 - sole_.collision.half_width_m - 0.03));
  EXPECT_NEAR(thing.sole_end_m + sole_.collision.toe_x_m, 0.14, 1e-9);
}

TEST_F(ThingsOnTreadTest, CellsOfOtherGroundOrAside_AreNoObstacles) {
  occupy(0.15, 0.1, kHeight_m + 0.13);
  occupy(0.15, 0.5);
  occupy(-0.1, 0.0);
  occupy(0.6, 0.0);
  add();
  EXPECT_TRUE(tread_.obstacles.empty());
}

TEST_F(ThingsOnTreadTest, CellsThatNoFootFitsBetween_AreOneObstacle) {
  occupy(0.20, -0.05);
  occupy(0.10, 0.05);
  add();
  ASSERT_EQ(tread_.obstacles.size(), 1U);
  EXPECT_TRUE(tread_.obstacles[0].meets(0.0, 0.0));
  EXPECT_NEAR(tread_.obstacles[0].sole_end_m + sole_.collision.toe_x_m, 0.09, 1e-9);
}

TEST_F(ThingsOnTreadTest, SmallLevelSurfaceAboveCells_IsTheirTop) {
  LevelSurface top;
  ASSERT_TRUE(prepare(tread(kHeight_m + 0.03, 0.1), 0.0, {}, {}, sole_, top));
  EXPECT_FALSE(is_top_of_thing(cells_, params_, top, work_));
  occupy(0.15, 0.05);
  EXPECT_TRUE(is_top_of_thing(cells_, params_, top, work_));
  EXPECT_FALSE(is_top_of_thing(cells_, params_, tread_, work_)) << "the tread itself is wide, and lies below";
}

}  // namespace
}  // namespace polygmap
