// SPDX-License-Identifier: Apache-2.0
// The legs as they were some milliseconds ago: an IMU that is late tells of then.
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "algorithms/estimation/contact/leg_measurement.hpp"

namespace polygmap {

struct StampedLegs {
  std::int64_t stamp_ns = 0;
  std::array<LegMeasurement, kFootCount> legs;
};

class LegHistory {
 public:
  static constexpr double kMost_s = 0.025;
  using Legs = std::array<LegMeasurement, kFootCount>;
  struct Moment {
    Legs legs;
    std::array<Vec3, kFootCount> base_v_foot_mps{Vec3::Zero(), Vec3::Zero()};  // differenced, of the newest legs
  };

  void clear() noexcept { samples_.clear(); }
  // Stamps increase.
  void push(std::int64_t stamp_ns, const Legs& legs) noexcept;
  // So long before the newest ones, no longer ago than kMost_s and than the oldest that are held. There are some.
  [[nodiscard]] Moment before(double delay_s) const noexcept;

 private:
  static constexpr double kSmoothing_s = 0.005;
  RingBuffer<StampedLegs, 32> samples_;  // at 1 kHz, kMost_s and some more
  std::array<Vec3, kFootCount> base_v_foot_mps_{Vec3::Zero(), Vec3::Zero()};
};

}  // namespace polygmap
