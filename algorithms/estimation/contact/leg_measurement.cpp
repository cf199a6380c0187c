// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/leg_measurement.hpp"

#include <Eigen/Geometry>

namespace polygmap {

LegMeasurement measure_leg(const LegGeometry& geometry, Foot leg, const JointVector& q_rad,
                           const JointVector& dq_radps) noexcept {
  const LegVector q = leg_joints(q_rad, leg);
  const Eigen::Matrix<double, 6, 1> rates = leg_jacobian(geometry, leg, q) * leg_joints(dq_radps, leg);
  return {base_T_sole(geometry, leg, q), rates.head<3>(), rates.tail<3>()};
}

Vec3 base_v_base_mps(const std::array<LegMeasurement, kFootCount>& legs) noexcept {
  Vec3 v_mps = Vec3::Zero();
  for (const LegMeasurement& leg : legs) {
    v_mps += (leg.base_w_sole_radps.cross(leg.base_T_sole.p_m) - leg.base_v_sole_mps) / kFootCount;
  }
  return v_mps;
}

}  // namespace polygmap
