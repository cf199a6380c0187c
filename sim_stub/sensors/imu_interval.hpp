// SPDX-License-Identifier: Apache-2.0
// An IMU whose samples come less often than the simulation's ticks: means over its own interval, stamped evenly at the
// end of each, whether a tick ends there or not.
#pragma once

#include <algorithm>
#include <cstdint>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::sim {

class ImuInterval {
 public:
  // Both above 0; the interval is a tick or longer.
  ImuInterval(std::int64_t interval_ns, std::int64_t tick_ns) : interval_ns_(interval_ns), tick_ns_(tick_ns) {}

  // A tick's mean, stamped at its end. True: that ends a sample, too.
  [[nodiscard]] bool push(const ImuSample& tick, ImuSample& sample) {
    if (interval_ns_ == tick_ns_) {
      sample = tick;
      return true;
    }
    const std::int64_t begin_ns = tick.stamp_ns - tick_ns_;
    if (due_ns_ < 0) due_ns_ = begin_ns + interval_ns_;
    add(tick, std::min(tick.stamp_ns, due_ns_) - begin_ns);
    if (tick.stamp_ns < due_ns_) return false;
    sample = {due_ns_, sum_.gyro_radps, sum_.accel_mps2};
    sum_ = {};
    due_ns_ += interval_ns_;
    add(tick, tick.stamp_ns - sample.stamp_ns);
    return true;
  }

 private:
  void add(const ImuSample& tick, std::int64_t part_ns) {
    const double share = static_cast<double>(part_ns) / static_cast<double>(interval_ns_);
    sum_.gyro_radps += share * tick.gyro_radps;
    sum_.accel_mps2 += share * tick.accel_mps2;
  }

  std::int64_t interval_ns_, tick_ns_;
  std::int64_t due_ns_ = -1;  // of the next sample; negative: nothing has come
  ImuSample sum_;             // by the share of the interval
};

}  // namespace polygmap::sim
