// SPDX-License-Identifier: Apache-2.0
// A clock that stands still until a test moves it. Time and counter move apart, so a test can let a tick come late
// without making work long, and make work long (an injected overrun) without letting time pass.
#pragma once

#include "hal/ports/clock.hpp"

namespace polygmap::fakes {

class FakeClock final : public hal::Clock {
 public:
  explicit FakeClock(double counts_per_us = 1000.0) noexcept : counts_per_us_(counts_per_us) {}

  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ns_; }
  [[nodiscard]] std::uint64_t count() const noexcept override { return count_; }
  [[nodiscard]] double counts_per_us() const noexcept override { return counts_per_us_; }

  void advance_ns(std::int64_t duration_ns) noexcept { now_ns_ += duration_ns; }
  void advance_count(std::uint64_t counts) noexcept { count_ += counts; }  // may wrap around
  void work_us(double duration_us) noexcept {
    count_ += static_cast<std::uint64_t>(duration_us * counts_per_us_ + 0.5);
  }

 private:
  double counts_per_us_;
  std::int64_t now_ns_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace polygmap::fakes
