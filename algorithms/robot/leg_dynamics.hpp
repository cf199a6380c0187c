// SPDX-License-Identifier: Apache-2.0
// The links' weights: where the centre of mass is, how it moves, and what the drives must hold.
#pragma once

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

// Of the whole robot, base frame.
struct CentreOfMass {
  Vec3 base_p_com_m = Vec3::Zero();
  Vec3 base_v_com_mps = Vec3::Zero();  // relative to the base, from the joint rates
};
[[nodiscard]] CentreOfMass centre_of_mass(const LegGeometry& geometry, const MassModel& masses,
                                          const JointVector& q_rad, const JointVector& dq_radps) noexcept;

// What the ground does to a sole, at the sole frame's origin, base axes.
struct SoleWrench {
  Vec3 force_n = Vec3::Zero();
  Vec3 moment_nm = Vec3::Zero();
};
// Drive torques of one leg whose links feel specific_mps2 (gravity minus their acceleration, base axes) while the
// ground presses on its sole: the static balance of every joint with all that hangs on it.
[[nodiscard]] LegVector leg_torques_nm(const LegGeometry& geometry, const MassModel& masses, Foot leg,
                                       const LegVector& q_rad, const Vec3& specific_mps2,
                                       const SoleWrench& ground) noexcept;

}  // namespace polygmap
