// SPDX-License-Identifier: Apache-2.0
// The time of an instance: its caller's, which may have its zero anywhere, laid on the module's, in which 0 means
// never. It stands still within a step.
#pragma once

#include <algorithm>
#include <cstdint>

#include "algorithms/core/time.hpp"
#include "hal/ports/clock.hpp"

namespace polygmap::link {

class InstanceClock final : public hal::Clock {
 public:
  // A sample that is stamped later than now by more is none of this clock's.
  static constexpr std::int64_t kMostAhead_ns = kNsPerS;

  // Of a caller whose time is the module's.
  [[nodiscard]] static InstanceClock of_module() noexcept {
    InstanceClock clock;
    clock.first_ns_ = kFirst_ns;
    return clock;
  }

  // False, and nothing changes: it does not come after the last one, or lies too far from the first.
  [[nodiscard]] bool try_advance(std::int64_t now_ns) noexcept {
    std::int64_t since_ns = 0;
    if (runs_ && now_ns <= now_ns_) return false;
    if (runs_ && (__builtin_sub_overflow(now_ns, first_ns_, &since_ns) || since_ns > kMost_ns)) return false;
    if (!runs_) first_ns_ = now_ns;
    runs_ = true;
    now_ns_ = now_ns;
    return true;
  }
  [[nodiscard]] bool runs() const noexcept { return runs_; }
  [[nodiscard]] bool is_far_ahead(std::int64_t stamp_ns) const noexcept {
    std::int64_t ahead_ns = 0;
    if (!runs_ || stamp_ns <= now_ns_) return false;
    return __builtin_sub_overflow(stamp_ns, now_ns_, &ahead_ns) || ahead_ns > kMostAhead_ns;
  }
  // Once it runs. What lies before the module's time is its beginning.
  [[nodiscard]] std::int64_t to_module(std::int64_t caller_ns) const noexcept {
    std::int64_t since_ns = 0;
    if (__builtin_sub_overflow(caller_ns, first_ns_, &since_ns))
      since_ns = caller_ns < first_ns_ ? -kFirst_ns : kMost_ns;
    return std::clamp(since_ns, 1 - kFirst_ns, kMost_ns) + kFirst_ns;
  }
  [[nodiscard]] std::int64_t to_caller(std::int64_t module_ns) const noexcept {
    return module_ns - kFirst_ns + first_ns_;
  }
  // The same of one whose 0 means never.
  [[nodiscard]] std::int64_t to_caller_or_0(std::int64_t module_ns) const noexcept {
    return module_ns == 0 ? 0 : to_caller(module_ns);
  }

  [[nodiscard]] std::int64_t now_ns() const noexcept override { return to_module(now_ns_); }
  [[nodiscard]] std::uint64_t count() const noexcept override { return static_cast<std::uint64_t>(now_ns()); }
  [[nodiscard]] double counts_per_us() const noexcept override { return 1000.0; }

 private:
  static constexpr std::int64_t kFirst_ns = 1024 * kNsPerS;        // the module's time of the first step
  static constexpr std::int64_t kMost_ns = std::int64_t{1} << 59;  // from there: 18 years

  bool runs_ = false;
  std::int64_t first_ns_ = 0, now_ns_ = 0;  // the caller's
};

}  // namespace polygmap::link
