// SPDX-License-Identifier: Apache-2.0
// The machine's own clocks.
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/linux/system/device_error.hpp"
#include "hal/linux/system/system_calls.hpp"
#include "hal/ports/clock.hpp"

namespace polygmap::hal {

// now_ns is CLOCK_MONOTONIC. The counter is the generic timer of AArch64 (cntvct_el0 at the rate of cntfrq_el0),
// elsewhere CLOCK_MONOTONIC_RAW in nanoseconds. Any number of threads may read it.
class PosixClock final : public Clock {
 public:
  explicit PosixClock(const SystemCalls& calls = kernel_calls()) noexcept : calls_(calls) {}
  // Fails where a clock cannot be read or its rate is out of the port's range.
  [[nodiscard]] DeviceError open() noexcept;

  [[nodiscard]] std::int64_t now_ns() const noexcept override;
  [[nodiscard]] std::uint64_t count() const noexcept override;
  [[nodiscard]] double counts_per_us() const noexcept override { return counts_per_us_; }
  // Readings that the kernel refused, which repeat the one before.
  [[nodiscard]] std::uint32_t failed_calls() const noexcept { return failed_calls_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] std::int64_t read_ns(clockid_t clock, std::atomic<std::int64_t>& last_ns) const noexcept;

  const SystemCalls& calls_;
  double counts_per_us_ = 1000.0;
  mutable std::atomic<std::int64_t> last_ns_{0};
  mutable std::atomic<std::int64_t> last_raw_ns_{0};
  mutable std::atomic<std::uint32_t> failed_calls_{0};
};

}  // namespace polygmap::hal
