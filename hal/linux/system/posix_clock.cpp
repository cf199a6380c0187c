// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/system/posix_clock.hpp"

#include <cerrno>

#include "algorithms/core/time.hpp"

namespace polygmap::hal {
namespace {

#ifdef __aarch64__
// The barrier keeps the reading from moving ahead of the work it ends.
[[nodiscard]] std::uint64_t generic_timer() noexcept {
  std::uint64_t count = 0;
  asm volatile("isb\n\tmrs %0, cntvct_el0" : "=r"(count)::"memory");
  return count;
}
[[nodiscard]] double generic_timer_per_us() noexcept {
  std::uint64_t rate_hz = 0;
  asm volatile("mrs %0, cntfrq_el0" : "=r"(rate_hz));
  return static_cast<double>(rate_hz) * 1e-6;
}
#endif

}  // namespace

DeviceError PosixClock::open() noexcept {
  timespec time{};
  if (calls_.clock_gettime(CLOCK_MONOTONIC, &time) != 0)
    return system_error("clock", "cannot read CLOCK_MONOTONIC", errno);
#ifdef __aarch64__
  counts_per_us_ = generic_timer_per_us();
#else
  if (calls_.clock_gettime(CLOCK_MONOTONIC_RAW, &time) != 0) {
    return system_error("clock", "cannot read CLOCK_MONOTONIC_RAW", errno);
  }
#endif
  if (!(counts_per_us_ >= 1.0 && counts_per_us_ <= 10'000.0)) {
    return device_error(DeviceErrorKind::kUnsuitable, "clock",
                        "the counter's rate of %g counts a microsecond is outside 1 to 10000", counts_per_us_);
  }
  return {};
}

std::int64_t PosixClock::read_ns(clockid_t clock, std::atomic<std::int64_t>& last_ns) const noexcept {
  timespec time{};
  if (calls_.clock_gettime(clock, &time) != 0) {
    failed_calls_.fetch_add(1, std::memory_order_relaxed);
    return last_ns.load(std::memory_order_relaxed);
  }
  const std::int64_t now_ns = time.tv_sec * kNsPerS + time.tv_nsec;
  last_ns.store(now_ns, std::memory_order_relaxed);
  return now_ns;
}

std::int64_t PosixClock::now_ns() const noexcept { return read_ns(CLOCK_MONOTONIC, last_ns_); }

std::uint64_t PosixClock::count() const noexcept {
#ifdef __aarch64__
  return generic_timer();
#else
  return static_cast<std::uint64_t>(read_ns(CLOCK_MONOTONIC_RAW, last_raw_ns_));
#endif
}

}  // namespace polygmap::hal
