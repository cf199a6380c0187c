// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace polygmap::codec {

// More than twice what IMUs of walking robots measure (2000 deg/s, 24 g): beyond is no measurement.
inline constexpr double kLargestImuRate_radps = 100.0;
inline constexpr double kLargestImuAccel_mps2 = 500.0;

}  // namespace polygmap::codec
