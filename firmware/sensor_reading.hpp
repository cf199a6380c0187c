// SPDX-License-Identifier: Apache-2.0
// From sensor ports into the estimator: alike for a robot's drivers and for a log that is replayed.
#pragma once

#include "algorithms/estimation/estimator.hpp"
#include "hal/ports/imu.hpp"
#include "hal/ports/lidar_odometry.hpp"

namespace polygmap {

// Of one port in one cycle: a backlog is worked off, a babbling driver is not followed.
inline constexpr int kMaxReadsPerCycle = 4;

// Before the tick. True when a sample came, good or bad.
inline bool read_imu(hal::Imu& port, std::int64_t now_ns, Estimator& estimator) noexcept {
  bool came = false;
  ImuSample sample;
  for (int i = 0; i < kMaxReadsPerCycle && port.try_read(sample); ++i) {
    estimator.add_imu(sample, now_ns);
    came = true;
  }
  return came;
}

// After the tick: a pose meets the state of its stamp, which may be this cycle's, and moves the next one.
inline void read_lio(hal::LidarOdometry& port, std::int64_t now_ns, Estimator& estimator) noexcept {
  LioSample sample;
  for (int i = 0; i < kMaxReadsPerCycle && port.try_read(sample); ++i) estimator.add_lio(sample, now_ns);
}

// While nothing is estimated: a pose of before the start is no news later.
inline void drop_lio(hal::LidarOdometry& port) noexcept {
  LioSample sample;
  for (int i = 0; i < kMaxReadsPerCycle && port.try_read(sample); ++i) {
  }
}

}  // namespace polygmap
