// SPDX-License-Identifier: Apache-2.0
// Cubes on treads under physics, perception in the loop: the robot steps beside them, or waits and says why.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <vector>

#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

// On the first tread, so far behind its riser and to the left.
SimOptions with_cube(double x_m, double y_m, double side_m) {
  SimOptions options = stairs_of(2, 1);
  options.stairs.jitter_m = 0.0;
  options.stairs.obstacles.push_back({{x_m, y_m, options.stairs.rise_m + 0.5 * side_m}, {side_m, side_m, side_m}});
  return options;
}

// Runs it to its end; the least distance of a sole to the cube on the way, 0 or less where it touched it.
double least_to_cube_m(PhysicalClimb& climb, double limit_s) {
  std::vector<SolidBox> cubes = solids_of(climb.stairs());
  std::erase_if(cubes, [](const SolidBox& solid) { return solid.step != kObstacleStep; });
  EXPECT_EQ(cubes.size(), 1U);
  double least_m = std::numeric_limits<double>::infinity();
  while (climb.time_s() < limit_s && climb.tick()) {
    for (const Transform& true_T_sole : climb.truth().true_T_sole) {
      const OrientedBox foot = collision_box(nominal_robot().sole, true_T_sole);
      least_m = clearance_m(foot, cubes, std::array{kFloorStep}, least_m);
    }
  }
  return least_m;
}

TEST(ThingOnTread, CubeWhereAFootWouldStand_WaitsAndStopsWithTheReason) {
  PhysicalClimb climb(with_cube(0.14, 0.1, 0.04));
  EXPECT_GT(least_to_cube_m(climb, 60.0), 0.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  if (climb.status().phase == GaitPhase::kFinished) return;  // it stood beside it
  EXPECT_EQ(climb.status().stop_reason, StopReason::kObstacle);
}

TEST(ThingOnTread, CubeBetweenTheFeet_ClimbsOverIt) {
  PhysicalClimb climb(with_cube(0.14, 0.0, 0.02));
  EXPECT_GT(least_to_cube_m(climb, 60.0), 0.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 2U);
}

}  // namespace
}  // namespace polygmap::sim
