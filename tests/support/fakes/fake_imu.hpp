// SPDX-License-Identifier: Apache-2.0
// Plays back the samples a test feeds, whatever is in them.
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/imu.hpp"
#include "tests/support/fakes/call_script.hpp"

namespace polygmap::fakes {

class FakeImu final : public hal::Imu {
 public:
  static constexpr std::size_t kCapacity = 64;

  void feed(const ImuSample& sample) noexcept { samples_.push_overwrite(sample); }
  CallScript reads;  // a failing read leaves the samples where they are

  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    return !reads.next_fails() && samples_.try_pop(sample);
  }

 private:
  RingBuffer<ImuSample, kCapacity> samples_;
};

}  // namespace polygmap::fakes
