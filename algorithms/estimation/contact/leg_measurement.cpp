// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/leg_measurement.hpp"

#include <Eigen/Geometry>

namespace polygmap {

LegMeasurement measure_leg(const LegFrames& frames, const LegVector& dq_radps) noexcept {
  const Eigen::Matrix<double, 6, 1> rates = leg_jacobian(frames) * dq_radps;
  return {frames.sole, rates.head<3>(), rates.tail<3>()};
}

Vec3 base_v_base_mps(const std::array<LegMeasurement, kFootCount>& legs) noexcept {
  Vec3 v_mps = Vec3::Zero();
  for (const LegMeasurement& leg : legs) {
    v_mps += (leg.base_w_sole_radps.cross(leg.base_T_sole.p_m) - leg.base_v_sole_mps) / kFootCount;
  }
  return v_mps;
}

}  // namespace polygmap
