// SPDX-License-Identifier: Apache-2.0
// Cubes on treads under physics, perception in the loop: the robot steps beside them, or waits and says why.
#include <gtest/gtest.h>

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

TEST(ThingOnTread, CubeWhereAFootWouldStand_WaitsAndStopsWithTheReason) {
  PhysicalClimb climb(with_cube(0.14, 0.1, 0.04));
  climb.run(60.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  if (climb.status().phase == GaitPhase::kFinished) return;  // it stood beside it
  EXPECT_EQ(climb.status().stop_reason, StopReason::kObstacle);
}

TEST(ThingOnTread, CubeBetweenTheFeet_ClimbsOverIt) {
  PhysicalClimb climb(with_cube(0.14, 0.0, 0.02));
  climb.run(60.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 2U);
}

}  // namespace
}  // namespace polygmap::sim
