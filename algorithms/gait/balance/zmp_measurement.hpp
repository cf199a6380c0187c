// SPDX-License-Identifier: Apache-2.0
// Where the ground presses, by what feet and ankle drives feel: the zero-moment point as it is, not as it was asked
// for.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

// odom_slope: of the ground's force, horizontal over vertical. False, and nothing changes, when forces or torques are
// not told (not a number, or ankles at exactly 0) or the feet together do not carry about the robot's weight.
[[nodiscard]] bool try_measure_zmp(const RobotModel& robot, const JointFeedback& felt,
                                   const std::array<Transform, kFootCount>& odom_T_sole, const Vec2& odom_slope,
                                   Vec2& odom_p_zmp_m) noexcept;

}  // namespace polygmap
