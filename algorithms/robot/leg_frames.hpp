// SPDX-License-Identifier: Apache-2.0
// The frames of one leg's joints: what kinematics and dynamics are both made of.
#pragma once

#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

// In the base frame, each after its own joint's rotation.
struct LegFrames {
  std::array<Transform, kJointsPerLeg> joint;
  Transform sole;
};
[[nodiscard]] LegFrames leg_frames(const LegGeometry& geometry, Foot leg, const LegVector& q_rad) noexcept;

// Of both legs: made once for a posture, then read by all that asks where its links are.
using BodyFrames = std::array<LegFrames, kFootCount>;
[[nodiscard]] BodyFrames body_frames(const LegGeometry& geometry, const JointVector& q_rad) noexcept;

// The column of a joint frame's rotation about which that joint turns: x, y or z.
inline constexpr std::array<int, kJointsPerLeg> kJointAxis{0, 2, 1, 1, 1, 0};

}  // namespace polygmap
