// SPDX-License-Identifier: Apache-2.0
// The robot that the simulation is of, as its data sheet says: what the module is given, what the report judges by, and
// what the plants build, up to the errors of sensors/robot_errors.hpp.
#pragma once

#include "algorithms/robot/robot_model.hpp"

namespace polygmap::sim {

[[nodiscard]] inline const RobotModel& nominal_robot() noexcept {
  static const RobotModel robot;
  return robot;
}

// Half of the torso's box, about its centre of mass.
[[nodiscard]] inline Vec3 torso_half_m() noexcept { return {0.1, 0.17, 0.28}; }

}  // namespace polygmap::sim
