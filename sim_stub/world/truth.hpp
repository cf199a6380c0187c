// SPDX-License-Identifier: Apache-2.0
// What only the simulation knows, per tick: for the report, never for the module.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/body_shapes.hpp"

namespace polygmap::sim {

// "true_" frames: the true world of stair_world.hpp, true geometry of the robot.
struct Truth {
  std::int64_t stamp_ns = 0;
  Transform true_T_base;
  std::array<Transform, kFootCount> true_T_sole;
  std::array<LegShapes, kFootCount> base_legs{};        // base frame, what the camera sees of them
  std::array<bool, kFootCount> in_contact{true, true};  // the sole stands on a surface
  std::array<double, kFootCount> load_share{0.5, 0.5};  // of the weight, sums to 1
  std::array<int, kFootCount> step_index{-1, -1};       // step under each standing sole (0-based), -1: floor
  Vec3 true_p_com_m = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());  // under physics only
  double zmp_margin_m = std::numeric_limits<double>::quiet_NaN();                // see plant.hpp
  JointVector drive_tau_nm = JointVector::Zero(), drive_dq_radps = JointVector::Zero();
  bool torque_limited = false;
  double closure_error_m = 0.0;  // distance by which the two standing legs disagree about the base
  bool fell = false;
  std::string fall_reason;  // one sentence with the number behind it
};

}  // namespace polygmap::sim
