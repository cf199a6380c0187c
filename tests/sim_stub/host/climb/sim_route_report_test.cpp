// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "sim_stub/host/climb/route_report.hpp"
#include "sim_stub/world/tops.hpp"

namespace polygmap::sim {
namespace {

using Names = std::vector<std::string>;

// Tops "a", "b", "c" at 0, 1, 2 m, as high as wide steps; "seam" touches c; "shelf" is not to be stood on.
StairWorld some_world() {
  StairWorld world;
  world.is_staircase = false;
  const auto add = [&world](const char* name, double x_m, double height_m, bool is_walkable = true) {
    Step top;
    top.name = name;
    top.true_T_step.p_m = {x_m, 0.0, height_m};
    top.back_x_m = top.half_width_m = 0.5;
    top.nosing_x_m = top.riser_x_m = -0.5;
    top.is_walkable = is_walkable;
    world.solids.push_back(
        {Vec3(-0.5, -0.5, -height_m), Vec3(0.5, 0.5, 0.0), static_cast<int>(world.steps.size()), top.true_T_step});
    world.steps.push_back(top);
  };
  add("a", 0.0, 0.1);
  add("b", 1.0, 0.2);
  add("c", 2.0, 0.3);
  add("seam", 3.0, 0.3);
  add("shelf", 9.0, 0.5, false);
  group_tops(world);
  return world;
}

class Walk {
 public:
  explicit Walk(const StairWorld& world) : route(world) {}
  // Both feet rest there for a tenth of a second.
  void rest(int left, int right) {
    for (int tick = 0; tick < 50; ++tick) {
      truth.stamp_ns += 2'000'000;
      truth.in_contact = {left > -10, right > -10};
      truth.step_index = {left, right};
      route.observe(truth);
    }
  }
  static constexpr int kInTheAir = -10;
  Truth truth;
  RouteReport route;
};

TEST(RouteReport, ThereAndBack_IsToldInOrder) {
  Walk walk(some_world());
  walk.rest(kFloorStep, kFloorStep);
  for (const int step : {0, 1, 2, 1, 0}) {
    walk.rest(step, Walk::kInTheAir);
    walk.rest(step, step);
  }
  EXPECT_EQ(walk.route.figures().surfaces_stood_on, (Names{"floor", "a", "b", "c", "b", "a"}));
}

TEST(RouteReport, Pace_IsFromTheFirstSurfaceItCameToToTheLast) {
  Walk walk(some_world());
  walk.rest(kFloorStep, kFloorStep);
  walk.rest(0, kFloorStep);
  EXPECT_TRUE(std::isnan(walk.route.figures().seconds_per_surface));
  for (const int step : {1, 2}) {
    walk.rest(step, Walk::kInTheAir);  // a tenth of a second
    walk.rest(step, step);
  }
  EXPECT_NEAR(walk.route.figures().seconds_per_surface, 0.15, 1e-9);  // comes to b after 0.1 s, to c 0.2 s later
}

TEST(RouteReport, OneFootOnEachTop_IsToldOnceEach) {
  Walk walk(some_world());
  walk.rest(kFloorStep, kFloorStep);
  walk.rest(0, Walk::kInTheAir);
  walk.rest(0, 1);
  walk.rest(2, 1);
  walk.rest(2, 2);
  EXPECT_EQ(walk.route.figures().surfaces_stood_on, (Names{"floor", "a", "b", "c"}));
}

TEST(RouteReport, SoleAcrossASeam_StaysWhereItIs) {
  Walk walk(some_world());
  for (int i = 0; i < 4; ++i) {
    walk.rest(2, 3);
    walk.rest(3, 2);
  }
  EXPECT_EQ(walk.route.figures().surfaces_stood_on, (Names{"c"}));
}

TEST(RouteReport, ShelfThatIsNotToBeStoodOn_IsNamed) {
  Walk walk(some_world());
  walk.rest(kFloorStep, kFloorStep);
  EXPECT_EQ(walk.route.figures().stood_on_wrongly, "");
  walk.rest(4, kFloorStep);
  EXPECT_EQ(walk.route.figures().stood_on_wrongly, "shelf");
}

TEST(RouteReport, Goal_IsOfPlaceHeadingAndSurface) {
  StairWorld world = some_world();
  world.goal = WorldPlace{2.0, 0.0, 0.1, 2};
  const auto reaches = [&world](double x_m, double yaw_rad, int step) {
    Walk walk(world);
    walk.truth.true_T_base = {rotation_z(yaw_rad), Vec3(x_m, 0.0, 1.1)};
    for (Transform& sole : walk.truth.true_T_sole) sole.p_m = {x_m, 0.0, 0.3};
    walk.rest(step, step);
    return *walk.route.figures().goal_reached;
  };
  EXPECT_TRUE(reaches(2.2, 0.3, 2));
  EXPECT_TRUE(reaches(2.2, 0.3, 3));  // one with the goal's
  EXPECT_FALSE(reaches(2.3, 0.3, 2));
  EXPECT_FALSE(reaches(2.2, 0.4, 2));
  EXPECT_FALSE(reaches(2.2, 0.3, 1));
  EXPECT_TRUE(reaches(2.2, 0.1 + 2.0 * kPi, 2));
}

TEST(RouteReport, TorsoInASolid_IsACollision) {
  Walk walk(some_world());
  walk.truth.true_T_base.p_m = {9.0, 0.0, 0.2};
  walk.rest(kFloorStep, kFloorStep);
  EXPECT_LT(walk.route.figures().body_clearance_min_m, 0.0);
  Walk clear(some_world());
  clear.truth.true_T_base.p_m = {-3.0, 0.0, 0.9};
  clear.rest(kFloorStep, kFloorStep);
  EXPECT_GT(clear.route.figures().body_clearance_min_m, 1.0);
}

}  // namespace
}  // namespace polygmap::sim
