// SPDX-License-Identifier: Apache-2.0
// What both legs measure in a posture.
#pragma once

#include "algorithms/estimation/contact/leg_measurement.hpp"

namespace polygmap::test {

[[nodiscard]] inline std::array<LegMeasurement, kFootCount> measured_legs(const LegGeometry& geometry,
                                                                          const JointVector& q_rad,
                                                                          const JointVector& dq_radps) {
  const BodyFrames frames = body_frames(geometry, q_rad);
  return {measure_leg(frames[0], leg_joints(dq_radps, Foot::kLeft)),
          measure_leg(frames[1], leg_joints(dq_radps, Foot::kRight))};
}

}  // namespace polygmap::test
