// SPDX-License-Identifier: Apache-2.0
// What a drive can give at its joint's speed, and commands that ask for no more.
#pragma once

#include <algorithm>
#include <cmath>

#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

// That drives a joint at this speed, either way.
[[nodiscard]] inline double torque_available_nm(const JointLimits& limits, double speed_radps) noexcept {
  const double speed = std::abs(speed_radps);
  if (speed <= limits.corner_radps) return limits.torque_nm;
  if (speed >= limits.no_load_radps) return 0.0;
  return limits.torque_nm * (limits.no_load_radps - speed) / (limits.no_load_radps - limits.corner_radps);
}

struct TorqueRange {
  double least_nm, most_nm;
};
// At this speed, with its sign: what brakes is all there whatever the speed.
[[nodiscard]] inline TorqueRange torque_range_nm(const JointLimits& limits, double speed_radps) noexcept {
  const double driving_nm = torque_available_nm(limits, speed_radps);
  return speed_radps < 0.0 ? TorqueRange{-driving_nm, limits.torque_nm} : TorqueRange{-limits.torque_nm, driving_nm};
}

// What a drive makes of its setpoint, its stiffness and damping included, where the joint is and as fast as it is.
[[nodiscard]] inline double torque_asked_nm(const JointSetpoint& joint, double q_rad, double dq_radps) noexcept {
  return joint.tau_ff_nm + joint.kp_nmprad * (joint.q_rad - q_rad) + joint.kd_nmsprad * (joint.dq_radps - dq_radps);
}

// Beyond the corner the setpoint's feed-forward torque is changed so that all of it asks for no more than the drive
// has, and where that is not enough its gains are lowered. A slower joint's setpoint stays as it is: what stiffness
// asks for beyond torque_nm the drive cuts. The feed-forward torque is no more than torque_nm.
void limit_torque(const JointLimits& limits, double q_rad, double dq_radps, JointSetpoint& joint) noexcept;

}  // namespace polygmap
