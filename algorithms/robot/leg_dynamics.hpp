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
// A vector for every link: the torso, and each leg's from the hip down.
struct PerLink {
  PerLink() noexcept {
    for (auto& links : leg) links.fill(Vec3::Zero());  // Eigen's own default is no value
  }
  Vec3 torso = Vec3::Zero();
  std::array<std::array<Vec3, kJointsPerLeg>, kFootCount> leg;
};
// Centres of all links, base frame.
[[nodiscard]] PerLink base_p_links_m(const LegGeometry& geometry, const MassModel& masses,
                                     const JointVector& q_rad) noexcept;

// Drive torques of one leg whose links feel specific_mps2 (gravity minus each one's acceleration, base axes) while the
// ground presses on its sole: the balance of every joint with all that hangs on it, links as points.
[[nodiscard]] LegVector leg_torques_nm(const LegGeometry& geometry, const MassModel& masses, Foot leg,
                                       const LegVector& q_rad, const std::array<Vec3, kJointsPerLeg>& specific_mps2,
                                       const SoleWrench& ground) noexcept;

}  // namespace polygmap
