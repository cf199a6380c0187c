// SPDX-License-Identifier: Apache-2.0
#include "algorithms/robot/drive_torque.hpp"

namespace polygmap {

void limit_torque(const JointLimits& limits, double q_rad, double dq_radps, JointSetpoint& joint) noexcept {
  if (std::abs(dq_radps) <= limits.corner_radps) return;
  const TorqueRange range = torque_range_nm(limits, dq_radps);
  const double asked_nm = torque_asked_nm(joint, q_rad, dq_radps);
  const double given_nm = math::clamp(asked_nm, range.least_nm, range.most_nm);
  if (given_nm == asked_nm) return;
  const double gains_nm = asked_nm - joint.tau_ff_nm;
  joint.tau_ff_nm = math::clamp(given_nm - gains_nm, -limits.torque_nm, limits.torque_nm);
  const double left_nm = given_nm - joint.tau_ff_nm;  // of either sign, as gains_nm
  if (std::abs(left_nm) >= std::abs(gains_nm)) return;
  joint.kp_nmprad *= left_nm / gains_nm;
  joint.kd_nmsprad *= left_nm / gains_nm;
}

}  // namespace polygmap
