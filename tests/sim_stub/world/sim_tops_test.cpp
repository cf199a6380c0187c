// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "sim_stub/world/tops.hpp"

namespace polygmap::sim {
namespace {

struct Box {
  double from_x_m, to_x_m, height_m;
};
StairWorld world_of(std::initializer_list<Box> boxes) {
  StairWorld world;
  world.is_staircase = false;
  for (const Box& box : boxes) {
    Step top;
    top.true_T_step.p_m = {0.5 * (box.from_x_m + box.to_x_m), 0.0, box.height_m};
    top.back_x_m = 0.5 * (box.to_x_m - box.from_x_m);
    top.nosing_x_m = top.riser_x_m = -top.back_x_m;
    top.half_width_m = 0.5;
    world.steps.push_back(top);
  }
  group_tops(world);
  return world;
}
double margin_m(const StairWorld& world, double x_m, double y_m = 0.0, double yaw_rad = 0.0) {
  return margin_on_tops_m({rotation_z(yaw_rad), Vec3(x_m, y_m, world.steps[0].true_T_step.p_m.z())}, world, 0,
                          nominal_robot().sole);
}
const SoleRectangle& contact() { return nominal_robot().sole.contact; }
constexpr double kFine_m = 2e-4;

TEST(MarginOnTops, SoleOnOneTop_IsToItsNearestEdge) {
  const StairWorld world = world_of({{0.0, 1.0, 0.2}});
  EXPECT_NEAR(margin_m(world, 0.5), 0.5 - contact().toe_x_m, kFine_m);
  EXPECT_NEAR(margin_m(world, 0.5, 0.4), 0.1 - contact().half_width_m, kFine_m);
  EXPECT_NEAR(margin_m(world, 1.0 - contact().toe_x_m + 0.03), -0.03, kFine_m + 0.5 * kSlit_m);
}

TEST(MarginOnTops, TopsThatTouch_AreOneWithoutASeam) {
  const StairWorld world = world_of({{0.0, 1.0, 0.2}, {1.0, 2.0, 0.2}, {2.0, 3.0, 0.33}});
  EXPECT_TRUE(world.are_one(0, 1));
  EXPECT_FALSE(world.are_one(1, 2));
  EXPECT_NEAR(margin_m(world, 1.0), 0.5 - contact().half_width_m, kFine_m);  // across the seam: the sides count
  EXPECT_NEAR(edge_behind_m(Vec3(1.5, 0, 0.2), 0.0, world, 1), 1.5, 1e-6);
}

TEST(MarginOnTops, GapBeneathTheSole_IsNoGround) {
  const StairWorld world = world_of({{0.0, 1.0, 0.2}, {1.03, 2.0, 0.2}});
  EXPECT_FALSE(world.are_one(0, 1));
  EXPECT_NEAR(margin_m(world, 1.0), -0.015, 1e-3);  // its corners are on tops, its middle on none
}

TEST(MarginOnTops, TurnedSole_IsToItsCorner) {
  const StairWorld world = world_of({{0.0, 1.0, 0.2}});
  const double yaw_rad = 0.3,
               toe_m = contact().toe_x_m * std::cos(yaw_rad) + contact().half_width_m * std::sin(yaw_rad);
  EXPECT_NEAR(margin_m(world, 0.7, 0.0, yaw_rad), 0.3 - toe_m, 0.02);  // eight directions of it
}

TEST(MarginOnTops, MatOnTheFloor_HasNoEdge) {
  const StairWorld world = world_of({{0.0, 1.0, 0.004}});
  EXPECT_TRUE(world.are_one(0, kFloorStep));
  EXPECT_TRUE(std::isinf(margin_m(world, 0.95)));
  EXPECT_TRUE(std::isnan(edge_behind_m(Vec3(0.5, 0, 0.004), 0.0, world, 0)));
}

TEST(EdgeBehind, TurnedHeading_IsAlongTheFoot) {
  const StairWorld world = world_of({{0.0, 1.0, 0.2}});
  EXPECT_NEAR(edge_behind_m(Vec3(0.3, 0, 0.2), 0.0, world, 0), 0.3, 1e-6);
  EXPECT_NEAR(edge_behind_m(Vec3(0.3, 0, 0.2), kPi, world, 0), 0.7, 1e-6);
  EXPECT_NEAR(edge_behind_m(Vec3(0.3, 0, 0.2), 0.5, world, 0), 0.3 / std::cos(0.5), 1e-3);
}

// Down stairs the tread behind reaches over the one that is stood on.
TEST(EdgeBehind, HigherTopOverThisOne_EndsItWhereThatBegins) {
  const StairWorld world = world_of({{0.0, 1.0, 0.2}, {-0.5, 0.03, 0.33}, {-0.5, 0.3, 0.1}});
  EXPECT_NEAR(edge_behind_m(Vec3(0.5, 0, 0.2), 0.0, world, 0), 0.47, 1e-6);
  EXPECT_NEAR(edge_behind_m(Vec3(0.5, 0, 0.2), kPi, world, 0), 0.5, 1e-6);
}

TEST(EdgeBehind, FloorAboveAndWhatIsNoTread_EndNothing) {
  StairWorld world = world_of({{0.0, 1.0, 0.2}, {0.1, 0.3, 2.2}, {0.1, 0.3, 0.3}});
  world.steps[2].is_walkable = false;
  EXPECT_NEAR(edge_behind_m(Vec3(0.5, 0, 0.2), 0.0, world, 0), 0.5, 1e-6);
}

}  // namespace
}  // namespace polygmap::sim
