// SPDX-License-Identifier: Apache-2.0
// The links' weights: where the centre of mass is, how it moves, and what the drives must hold.
#pragma once

#include "algorithms/robot/leg_frames.hpp"

namespace polygmap {

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
[[nodiscard]] PerLink base_p_links_m(const MassModel& masses, const BodyFrames& frames) noexcept;

// Centre of mass of the whole robot, in the frame of the links' centres.
[[nodiscard]] Vec3 centre_of_mass_m(const MassModel& masses, const PerLink& p_m) noexcept;
// Its velocity relative to the base from the joint rates, base frame.
[[nodiscard]] Vec3 base_v_com_mps(const MassModel& masses, const BodyFrames& frames, const PerLink& base_p_m,
                                  const JointVector& dq_radps) noexcept;

// Drive torques of one leg whose links feel specific_mps2 (gravity minus each one's acceleration, base axes) while the
// ground presses on its sole: the balance of every joint with all that hangs on it, links as points.
[[nodiscard]] LegVector leg_torques_nm(const MassModel& masses, Foot leg, const LegFrames& frames,
                                       const std::array<Vec3, kJointsPerLeg>& specific_mps2,
                                       const SoleWrench& ground) noexcept;

}  // namespace polygmap
