// SPDX-License-Identifier: Apache-2.0
// A robot at rest on both bent legs: what its drives and feet feel.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/leg_dynamics.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::test {

// base_up: the vertical. The soles are parallel to the base's own floor whatever that is, and together press under the
// centre of mass, the left one with that share of the weight.
[[nodiscard]] inline JointFeedback standing_on_both(const Vec3& base_up, double left_share) {
  const RobotModel& robot = nominal_robot();
  JointFeedback felt;
  std::array<Transform, kFootCount> base_T_sole;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    base_T_sole[index_of(foot)].p_m = {0.0, side_sign(foot) * kStanceHalfWidth_m, -kNominalBaseHeight_m};
    felt.q_rad.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
        solve_leg(robot.legs, foot, base_T_sole[index_of(foot)]).q_rad;
  }
  const BodyFrames frames = body_frames(robot.legs, felt.q_rad);
  const Vec3 base_p_com_m = centre_of_mass_m(robot.masses, base_p_links_m(robot.masses, frames));
  const Vec3 base_p_pressed_m = base_p_com_m - (base_p_com_m.z() + kNominalBaseHeight_m) / base_up.z() * base_up;
  const double weight_n = robot.masses.total_kg() * kGravity_mps2;
  std::array<Vec3, kJointsPerLeg> weight_mps2;
  weight_mps2.fill(-kGravity_mps2 * base_up);
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const std::size_t f = index_of(foot);
    felt.foot_force_n[f] = weight_n * (foot == Foot::kLeft ? left_share : 1.0 - left_share);
    const Vec3 force_n = felt.foot_force_n[f] * base_up;
    const SoleWrench ground{force_n, (base_p_pressed_m - base_T_sole[f].p_m).cross(force_n)};
    felt.tau_nm.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
        leg_torques_nm(robot.masses, foot, frames[f], weight_mps2, ground);
  }
  return felt;
}

}  // namespace polygmap::test
