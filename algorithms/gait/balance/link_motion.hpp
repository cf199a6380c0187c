// SPDX-License-Identifier: Apache-2.0
// How the planned motion accelerates every link: second differences of the plan, which is smooth.
#pragma once

#include "algorithms/core/time.hpp"
#include "algorithms/robot/leg_dynamics.hpp"

namespace polygmap {

class LinkMotion {
 public:
  struct Acceleration {  // zero for two ticks after a restart
    PerLink plan_mps2;
    JointVector joint_radps2 = JointVector::Zero();
  };
  // The plan goes on from elsewhere.
  void restart() noexcept { known_ = 0; }
  [[nodiscard]] bool restarted() const noexcept { return known_ == 0; }
  // The plan goes on as it was, in another frame.
  void carry(const Transform& to_T_plan) noexcept;
  // One tick, planned posture. The result belongs to the tick before.
  [[nodiscard]] Acceleration update(const Transform& plan_T_base, const PerLink& base_p_m,
                                    const JointVector& q_rad) noexcept;

 private:
  struct Posture {
    PerLink plan_p_m;
    JointVector q_rad = JointVector::Zero();
  };
  std::array<Posture, 2> past_;  // the newer one first
  int known_ = 0;
};

// Rate of the links' angular momentum about the centre of mass, without the torso's own turning.
[[nodiscard]] Vec3 angular_momentum_rate_nm(const MassModel& masses, const PerLink& p_m, const PerLink& mps2) noexcept;

}  // namespace polygmap
