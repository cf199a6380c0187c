// SPDX-License-Identifier: Apache-2.0
// A clock that stands still until a test moves it. Time and cycles move apart, so a test can let a tick come late
// without making work long, and make work long (an injected overrun) without letting time pass.
#pragma once

#include "hal/ports/clock.hpp"

namespace polygmap::fakes {

class FakeClock final : public hal::Clock {
 public:
  explicit FakeClock(double cycles_per_us = 1000.0) noexcept : cycles_per_us_(cycles_per_us) {}

  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ns_; }
  [[nodiscard]] std::uint64_t cycles() const noexcept override { return cycles_; }
  [[nodiscard]] double cycles_per_us() const noexcept override { return cycles_per_us_; }

  void advance_ns(std::int64_t duration_ns) noexcept { now_ns_ += duration_ns; }
  void advance_cycles(std::uint64_t cycles) noexcept { cycles_ += cycles; }  // may wrap around
  void work_us(double duration_us) noexcept {
    cycles_ += static_cast<std::uint64_t>(duration_us * cycles_per_us_ + 0.5);
  }

 private:
  double cycles_per_us_;
  std::int64_t now_ns_ = 0;
  std::uint64_t cycles_ = 0;
};

}  // namespace polygmap::fakes
