// SPDX-License-Identifier: Apache-2.0
// How far measurements lay from their predictions. Normalised: the innovation squared, over its variance, per row: 1 in
// the mean where the filter knows how good it and the measurement are, more where it is too sure of itself.
#pragma once

#include <algorithm>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

enum class MeasurementGroup : std::uint8_t {
  kFootPosition,  // of a standing foot, eq. (3): 3 rows a foot
  kSoleAttitude,  // the same of its rotation, where kinematics knows it
  kTreadHeight,   // of a contact on a tread of known height, eq. (4)
  kLioPosition,   // of a LIO pose against the fused one at its stamp, once aligned: 3 rows
  kLioYaw
};
inline constexpr std::size_t kMeasurementGroupCount = 5;

// Rows of one update.
struct NormalisedRows {
  double sum = 0.0;
  std::uint32_t rows = 0;
  void take(double squares, std::uint32_t count) noexcept {
    sum += squares;
    rows += count;
  }
};

struct InnovationStatistics {
  std::int64_t stamp_ns = -1;  // of the last update; -1: none yet
  std::uint32_t count = 0;     // updates
  double last = 0.0;           // mean over its rows
  double recent = 0.0;         // mean over about the last second
  double mean = 0.0;           // over all updates

  void take(const NormalisedRows& update, std::int64_t now_ns) noexcept {
    if (update.rows == 0) return;
    constexpr double kRecent_s = 1.0;
    const double dt_s = stamp_ns < 0 ? 0.0 : seconds(now_ns - stamp_ns);
    last = update.sum / update.rows;
    ++count;
    recent += (count == 1 ? 1.0 : std::max(dt_s, 0.0) / (kRecent_s + dt_s)) * (last - recent);
    mean += (last - mean) / count;
    stamp_ns = now_ns;
  }
};

}  // namespace polygmap
