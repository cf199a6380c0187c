// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/leg_measurement.hpp"

namespace polygmap {

LegMeasurement measure_leg(const LegGeometry& geometry, Foot leg, const JointVector& q_rad,
                           const JointVector& dq_radps) noexcept {
  const LegVector q = leg_joints(q_rad, leg);
  const Eigen::Matrix<double, 6, 1> rates = leg_jacobian(geometry, leg, q) * leg_joints(dq_radps, leg);
  return {base_T_sole(geometry, leg, q), rates.head<3>(), rates.tail<3>()};
}

}  // namespace polygmap
