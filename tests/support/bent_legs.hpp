// SPDX-License-Identifier: Apache-2.0
// Both legs bent, each joint otherwise.
#pragma once

#include "algorithms/robot/leg_dynamics.hpp"
#include "algorithms/robot/leg_frames.hpp"

namespace polygmap::test {

inline JointVector bent_q_rad() {
  JointVector q;
  q << 0.05, 0.1, -0.5, 0.9, -0.4, -0.03, -0.04, -0.1, -0.3, 0.7, -0.35, 0.06;
  return q;
}

inline PerLink links_m(const JointVector& q_rad) { return base_p_links_m({}, body_frames({}, q_rad)); }

}  // namespace polygmap::test
