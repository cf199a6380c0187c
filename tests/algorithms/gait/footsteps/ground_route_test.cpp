// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/ground_route.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

using Way = GroundRoute::Way;

class GroundRouteTest : public ::testing::Test {
 protected:
  const GroundRouteParams params_{};
  GroundView ground_ = everywhere();
  GroundRoute::Barred barred_;
  GroundRoute route_;

  [[nodiscard]] static GroundView everywhere() {
    GroundView ground;
    ground.corner_m = Vec2{-32, -32} * GroundView::kCell_m;
    ground.level.fill(~std::uint64_t{0});
    return ground;
  }
  template <typename There>
  void set(GroundView::Rows& rows, bool to, const There& there) const {
    for (std::int32_t y = 0; y < GroundView::kSide_cells; ++y) {
      for (std::int32_t x = 0; x < GroundView::kSide_cells; ++x) {
        const Vec2 p_m = ground_.corner_m + Vec2{x + 0.5, y + 0.5} * GroundView::kCell_m;
        const std::uint64_t bit = std::uint64_t{1} << static_cast<std::uint32_t>(x);
        if (there(p_m)) (rows[static_cast<std::size_t>(y)] &= ~bit) |= to ? bit : 0;
      }
    }
  }
  [[nodiscard]] Way find(const Vec2& from_m, const Vec2& to_m) {
    route_.begin(params_, ground_, barred_, from_m, to_m);
    while (route_.is_busy()) route_.step(params_);
    return route_.way();
  }
  // From place to place of the way; where it ends.
  [[nodiscard]] Vec2 walk(Vec2 at_m, const Vec2& to_m, double& length_m) {
    length_m = 0.0;
    for (int i = 0; i < 60; ++i) {
      const Way way = find(at_m, to_m);
      if (way == Way::kShut) return at_m;
      const Vec2 next_m = way == Way::kStraight ? to_m : route_.via_m();
      const Vec2 way_m = next_m - at_m;
      const Vec2 step_m = way_m.norm() > 0.15 ? Vec2{0.15 / way_m.norm() * way_m} : way_m;
      at_m += step_m;
      length_m += step_m.norm();
      if (way == Way::kStraight && way_m.norm() <= 0.15) return at_m;
    }
    return at_m;
  }
};

TEST_F(GroundRouteTest, NothingInTheWay_IsStraight) { EXPECT_EQ(find({0, 0}, {3.0, 0.5}), Way::kStraight); }

TEST_F(GroundRouteTest, BoxInTheWay_GoesRoundItByTheShorterSide) {
  set(ground_.tall, true,
      [](const Vec2& p_m) { return p_m.x() > 0.1 && p_m.x() < 0.4 && p_m.y() > -0.1 && p_m.y() < 0.4; });
  ASSERT_EQ(find({-0.4, 0}, {1.2, 0.1}), Way::kRound);
  EXPECT_LT(route_.via_m().y(), -0.2);
  double length_m = 0.0;
  const Vec2 end_m = walk({-0.4, 0}, {1.2, 0.1}, length_m);
  EXPECT_NEAR((end_m - Vec2{1.2, 0.1}).norm(), 0.0, 1e-9);
  EXPECT_LT(length_m, 2.2) << "the shortest is 1.87 m";
}

TEST_F(GroundRouteTest, WallWithADoor_GoesThroughTheDoor) {
  set(ground_.tall, true,
      [](const Vec2& p_m) { return p_m.x() > 0.6 && p_m.x() < 0.7 && !(p_m.y() > 0.2 && p_m.y() < 1.2); });
  double length_m = 0.0;
  const Vec2 end_m = walk({0, -0.2}, {1.2, -0.2}, length_m);
  EXPECT_NEAR((end_m - Vec2{1.2, -0.2}).norm(), 0.0, 1e-9);
  EXPECT_LT(length_m, 2.5);
}

TEST_F(GroundRouteTest, GroundSeenOnOneSideOnly_GoesRoundThere) {
  const auto box = [](const Vec2& p_m) { return p_m.x() > 0.5 && p_m.x() < 0.9 && std::abs(p_m.y()) < 0.2; };
  set(ground_.tall, true, box);
  for (const double side : {-1.0, 1.0}) {
    route_.clear();
    ground_.level = everywhere().level;
    set(ground_.level, false, [&](const Vec2& p_m) { return side * p_m.y() > 0.1; });
    ASSERT_EQ(find({0, 0}, {1.2, 0.0}), Way::kRound);
    EXPECT_LT(side * route_.via_m().y(), 0.0);
  }
}

TEST_F(GroundRouteTest, WhereItLookedThereIsNoGround_GoesRoundIt) {
  const auto hole = [](const Vec2& p_m) { return p_m.x() > 0.3 && p_m.x() < 0.7 && std::abs(p_m.y()) < 0.3; };
  set(ground_.level, false, hole);
  EXPECT_EQ(find({0, 0}, {1.2, 0.0}), Way::kStraight) << "nobody looked yet";
  set(barred_.unseen, true, hole);
  ASSERT_EQ(find({0, 0}, {1.2, 0.0}), Way::kRound);
  EXPECT_GT(std::abs(route_.via_m().y()), 0.3);
}

TEST_F(GroundRouteTest, WhereItStoodAndCameNoFurther_GoesElsewhere) {
  set(barred_.tried, true, [](const Vec2& p_m) { return (p_m - Vec2{0.5, 0.0}).norm() < 0.35; });
  EXPECT_EQ(find({0, 0}, {1.2, 0.0}), Way::kRound);
}

// Between two ways as long it would turn to and fro for ever.
TEST_F(GroundRouteTest, OneOfTwoWaysWalkedAlready_TakesTheOther) {
  const auto box = [](const Vec2& p_m) { return p_m.x() > 0.4 && p_m.x() < 0.7 && std::abs(p_m.y()) < 0.4; };
  set(ground_.tall, true, box);
  for (const double side : {1.0, -1.0}) {
    barred_.walked = {};
    set(barred_.walked, true, [&](const Vec2& p_m) { return side * p_m.y() > 0.2; });
    route_.clear();
    ASSERT_EQ(find({0, 0}, {1.2, 0.0}), Way::kRound);
    EXPECT_LT(side * route_.via_m().y(), 0.0);
  }
}

TEST_F(GroundRouteTest, WallsAllAround_ThereIsNoWay) {
  set(ground_.tall, true,
      [](const Vec2& p_m) { return p_m.cwiseAbs().maxCoeff() > 0.6 && p_m.cwiseAbs().maxCoeff() < 0.7; });
  EXPECT_EQ(find({0, 0}, {2.0, 0.0}), Way::kShut);
  EXPECT_EQ(find({0, 0}, {-0.3, 2.0}), Way::kShut);
}

TEST_F(GroundRouteTest, GoalOnAThing_LeadsToTheNearestPlaceBesideIt) {
  set(ground_.tall, true,
      [](const Vec2& p_m) { return p_m.x() > -0.2 && p_m.x() < 0.4 && p_m.y() > 0.5 && p_m.y() < 0.9; });
  double length_m = 0.0;
  const Vec2 end_m = walk({-0.7, 0.9}, {0.3, 0.55}, length_m);
  EXPECT_NEAR(end_m.x(), 0.3, 0.25);
}

TEST_F(GroundRouteTest, ThingFarAhead_MayBeStairs) {
  set(ground_.tall, true, [&](const Vec2& p_m) { return p_m.x() > params_.ahead_m + 0.05; });
  EXPECT_EQ(find({0, 0}, {2.0, 0.0}), Way::kStraight);
}

}  // namespace
}  // namespace polygmap
