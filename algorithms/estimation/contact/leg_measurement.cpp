// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/leg_measurement.hpp"

namespace polygmap {

LegMeasurement measure_leg(const LegFrames& frames, const LegVector& dq_radps) noexcept {
  const Eigen::Matrix<double, 6, 1> rates = leg_jacobian(frames) * dq_radps;
  return {frames.sole, rates.head<3>(), rates.tail<3>()};
}

}  // namespace polygmap
