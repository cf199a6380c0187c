// SPDX-License-Identifier: Apache-2.0
// Where up is for a robot that stands still on both feet, by its joints alone: as its soles have it, and as its weight
// does, which hangs above where the ground presses.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

struct StandingVerticalParams {
  double min_weight_share = 0.7, max_weight_share = 1.4;
  double pressed_n = 50.0;

  static void visit(auto& p, auto& field) {
    field("min_weight_share", p.min_weight_share, 0.0, 1.0,
          "Feet that carry less of the weight do not tell where it hangs: a sensor is wrong, or somebody holds it.");
    field("max_weight_share", p.max_weight_share, 1.0, 10.0,
          "Feet that carry more than this share of the weight do not tell where it hangs: a sensor is wrong.");
    field("pressed_n", p.pressed_n, 1.0, 500.0, "Both feet are pressed by more while it stands on both.");
  }
};

// In base axes, of unit length. Errs by the mean of what the floor slopes by under either sole, and by that of what
// each leg's three pitch and two roll encoders are off by.
[[nodiscard]] Vec3 up_by_soles(const LegGeometry& legs, const JointVector& q_rad) noexcept;

// Likewise. felt: forces and torques as the legs need them (LegSensing::joints()). All that is above the ankles hangs
// on what these feel: its centre is straight above the point where ankle forces and torques have it carried. Error:
// what the masses have their centre off by, and ankles their torques, over its height, 10 mm over 0.8 m. False, and
// nothing changes, when forces or torques are not told (not a number, or ankles at exactly 0) or the feet do not both
// carry, or together not about the robot's weight.
[[nodiscard]] bool try_up_by_statics(const StandingVerticalParams& params, const RobotModel& robot,
                                     const JointFeedback& felt, Vec3& base_up) noexcept;

}  // namespace polygmap
