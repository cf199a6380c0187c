// SPDX-License-Identifier: Apache-2.0
// What a controller may believe of a StateEstimate: its covariance, and what the measurements say of that.
#pragma once

#include <array>

#include "algorithms/estimation/quality/innovation.hpp"

namespace polygmap {

struct EstimateQuality {
  std::int64_t stamp_ns = 0;  // of the state it belongs to
  // Of world_p_base (m), odom_v_base (m/s) and the rotation that takes the estimated attitude to the true one (rad,
  // odom axes), in this order: of what is true minus what is estimated. Symmetric.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  std::array<InnovationStatistics, kMeasurementGroupCount> innovations{};
  std::uint32_t outliers = 0;  // updates so far whose weight was reduced, their innovation was that large

  [[nodiscard]] const InnovationStatistics& innovations_of(MeasurementGroup group) const noexcept {
    return innovations[static_cast<std::size_t>(group)];
  }
};

}  // namespace polygmap
