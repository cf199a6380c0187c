// SPDX-License-Identifier: Apache-2.0
// Vertical foot forces from joint torques, for a robot without force sensors.
//
// A light leg at rest passes its foot's wrench on to its joints: tau = -J' w. Its own weight and inertia, and friction
// beyond what the low-pass takes away, are errors of the result; a leg that swings fast feigns some force.
#pragma once

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

class ForceInference {
 public:
  struct Params {
    double smoothing_s = 0.008;
    double friction_n = 20.0;
    double damping_m = 0.02;

    static void visit(auto& p, auto& field) {
      field("smoothing_s", p.smoothing_s, 0.0, 0.1, "Time constant of the inferred forces' low-pass.");
      field("friction_n", p.friction_n, 0.0, 200.0, "The joints' friction may feign as much: a smaller force is none.");
      field("damping_m", p.damping_m, 0.001, 0.2,
            "Damping of the inverse against a stretched knee: 0.02 takes 1 to 2 % of the force.");
    }
  };
  void reset(const Params& params) noexcept;
  // base_up: the vertical in base axes. Forces in N, upwards on the foot, never negative.
  [[nodiscard]] std::array<double, kFootCount> update(const LegGeometry& geometry, const JointFeedback& joints,
                                                      const Vec3& base_up) noexcept;

 private:
  Params params_;
  std::array<double, kFootCount> force_n_{};
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
