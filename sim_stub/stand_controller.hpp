// SPDX-License-Identifier: Apache-2.0
// Whoever holds the robot before the module speaks, and after it has let go: drives at their own gains around a
// posture, and a balance of its own that knows the true state. The module takes over from it, and hands over to it.
#pragma once

#include <optional>

#include "sim_stub/plant/plant.hpp"

namespace polygmap::sim {

class StandController {
 public:
  struct Gains {  // of either leg's drives
    std::array<double, kJointsPerLeg> kp_nmprad, kd_nmsprad;
  };
  StandController(const JointVector& q_rad, const Gains& gains) : q_rad_(q_rad), gains_(gains) {}

  // It holds that posture from now on, and the centre of mass where it finds it.
  void meet(const JointVector& q_rad) {
    q_rad_ = q_rad;
    centre_.reset();
  }
  // One tick. The centre of mass stays where it was at the first.
  [[nodiscard]] JointCommand command(const Plant& plant);

 private:
  // That the legs hold the robot's weight with, pressing where its divergent component is pushed back.
  [[nodiscard]] JointVector torques_nm(const Plant& plant);

  JointVector q_rad_;
  Gains gains_;
  struct Centre {
    Vec3 first_m, last_m;
  };
  std::optional<Centre> centre_;  // of mass, true axes
};

}  // namespace polygmap::sim
