// SPDX-License-Identifier: Apache-2.0
// The periods that tests run at.
#pragma once

#include <cstdint>
#include <limits>

#include "algorithms/core/time.hpp"

namespace polygmap::test {

inline constexpr std::int64_t kTick_ns = 2 * kNsPerMs;
inline constexpr double kTick_s = seconds(kTick_ns);
inline constexpr std::int64_t kLioPeriod_ns = 100 * kNsPerMs;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace polygmap::test
