// SPDX-License-Identifier: Apache-2.0
// Plays back the poses a test feeds, whatever is in them.
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "tests/support/fakes/call_script.hpp"

namespace polygmap::fakes {

class FakeLidarOdometry final : public hal::LidarOdometry {
 public:
  static constexpr std::size_t kCapacity = 8;

  void feed(const LioSample& sample) noexcept { samples_.push_overwrite(sample); }
  CallScript reads;  // a failing read leaves the poses where they are

  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    return !reads.next_fails() && samples_.try_pop(sample);
  }

 private:
  RingBuffer<LioSample, kCapacity> samples_;
};

}  // namespace polygmap::fakes
