// SPDX-License-Identifier: Apache-2.0
// What is measured of one foot relative to the base. Joint kinematics is one way to make it; a log's foot positions are
// another.
#pragma once

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

// In base axes. Joint kinematics knows all of it; a point foot, or a log of positions, knows the position alone.
struct LegMeasurement {
  Transform base_T_sole;
  Vec3 base_v_sole_mps = Vec3::Zero();
  Vec3 base_w_sole_radps = Vec3::Zero();
  bool sole_known = true;          // its rotation and motion; without them the foot is one point
  double position_sigma_m = 3e-4;  // white noise of the position, per axis
};

[[nodiscard]] LegMeasurement measure_leg(const LegGeometry& geometry, Foot leg, const JointVector& q_rad,
                                         const JointVector& dq_radps) noexcept;

}  // namespace polygmap
