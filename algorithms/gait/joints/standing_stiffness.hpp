// SPDX-License-Identifier: Apache-2.0
// Whether drives can keep a robot upright by their stiffness alone, before there is an estimate to balance by.
#pragma once

#include "algorithms/gait/joints/joint_reference.hpp"

namespace polygmap {

// Derivation. Soles stay on the ground, both legs move alike, drives are springs about the nominal stance, whose weight
// is fed forward. Seen from the side each leg is a chain of ankle, knee and hip pitch, axes parallel: turning joints i
// and j, j the upper one or the same, lowers the potential by G_ij = g * sum of m (z - z_j) over what is above j, half
// the torso per leg, and raises it by the springs' K. It stands where K - G is positive definite: where the largest
// eigenvalue of G against K is below 1. Seen from the front hips, ankles and torso are a parallelogram of four springs.
struct StandingStiffness {
  // Largest share of the springs' work that gravity gives back; at 1 the robot topples.
  double from_the_side = 0.0;
  double from_the_front = 0.0;
  // The gain that all pitch drives would need to stand at kMaxTopplingShare.
  double least_kp_nmprad = 0.0;
};
// A quarter of the stiffness in hand: for delays, soft ground and a body that is heavier than it is believed to be.
inline constexpr double kMaxTopplingShare = 0.8;

// With the gains that JointReference::hold() commands.
[[nodiscard]] StandingStiffness standing_stiffness(const RobotModel& robot,
                                                   const JointReference::Params& params) noexcept;
[[nodiscard]] constexpr bool can_stand(const StandingStiffness& stiffness) noexcept {
  return stiffness.from_the_side <= kMaxTopplingShare && stiffness.from_the_front <= kMaxTopplingShare;
}

}  // namespace polygmap
