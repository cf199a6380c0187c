// SPDX-License-Identifier: Apache-2.0
// Brings stamps of other clocks into the monotonic clock of this machine.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "algorithms/core/time.hpp"
#include "hal/linux/system/descriptor.hpp"
#include "hal/linux/system/system_calls.hpp"

namespace polygmap::hal {

// Of one reading of CLOCK_MONOTONIC and CLOCK_REALTIME each: the kernel stamps packets in the latter.
struct ClockReading {
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_ns = 0;
  bool good = false;  // false: a clock could not be read

  [[nodiscard]] std::int64_t to_monotonic_ns(std::int64_t stamp_ns) const noexcept {
    return stamp_ns - realtime_ns + monotonic_ns;
  }
};
[[nodiscard]] inline ClockReading read_clocks(const SystemCalls& calls) noexcept {
  timespec monotonic{}, realtime{};
  ClockReading reading;
  reading.good =
      calls.clock_gettime(CLOCK_MONOTONIC, &monotonic) == 0 && calls.clock_gettime(CLOCK_REALTIME, &realtime) == 0;
  reading.monotonic_ns = monotonic.tv_sec * kNsPerS + monotonic.tv_nsec;
  reading.realtime_ns = realtime.tv_sec * kNsPerS + realtime.tv_nsec;
  return reading;
}

enum class TimeBase : std::uint8_t {
  kMonotonic,  // the sender stamps in this machine's CLOCK_MONOTONIC: it runs here
  kEstimated,  // a clock of the sender's own: its offset is estimated from the times of arrival
};

// The offset of a sender's clock, from stamps and times of arrival. What arrived fastest was delayed least: the offset
// is the least difference of the last one to two windows, less the delay that even the fastest has. Two clocks that
// drift apart by 100 ppm differ by 0.4 ms in two windows. The estimate is late by what the least delay is taken wrong.
class ClockOffset {
 public:
  struct Params {
    std::int64_t window_ns = 2 * kNsPerS;
    std::int64_t jump_ns = 500 * kNsPerMs;  // beyond that the clock was set, or the packet is late
    std::uint32_t confirm = 20;             // so many such in a row: it was set
    std::int64_t least_delay_ns = 0;        // of a sample, from its stamp to its arrival
  };
  constexpr ClockOffset() noexcept = default;
  explicit constexpr ClockOffset(const Params& params) noexcept : params_(params) {}

  // The stamp in the monotonic clock; none for a packet that is late by more than jump_ns, or whose clock was set and
  // is not yet believed. Both below 2^62.
  [[nodiscard]] constexpr std::optional<std::int64_t> to_monotonic_ns(std::int64_t sender_ns,
                                                                      std::int64_t arrival_ns) noexcept {
    const std::int64_t difference_ns = arrival_ns - sender_ns;
    if (known_) {
      const std::int64_t off_ns = difference_ns - least_ns();
      if (off_ns > params_.jump_ns || off_ns < -params_.jump_ns) {
        if (++strange_ < params_.confirm) return std::nullopt;
        ++restarts_;
        known_ = false;
      }
    }
    strange_ = 0;
    if (!known_) {
      known_ = true;
      current_ns_ = previous_ns_ = difference_ns;
      window_begin_ns_ = arrival_ns;
    }
    if (arrival_ns - window_begin_ns_ >= params_.window_ns) {
      previous_ns_ = current_ns_;
      current_ns_ = difference_ns;
      window_begin_ns_ = arrival_ns;
    }
    current_ns_ = std::min(current_ns_, difference_ns);
    return sender_ns + least_ns() - params_.least_delay_ns;
  }
  // The sender says that its clock is another one now.
  constexpr void restart() noexcept { known_ = false; }
  [[nodiscard]] constexpr std::uint32_t restarts() const noexcept { return restarts_; }

 private:
  [[nodiscard]] constexpr std::int64_t least_ns() const noexcept { return std::min(current_ns_, previous_ns_); }

  Params params_;
  bool known_ = false;
  std::int64_t current_ns_ = 0;
  std::int64_t previous_ns_ = 0;
  std::int64_t window_begin_ns_ = 0;
  std::uint32_t strange_ = 0;
  std::uint32_t restarts_ = 0;
};

struct TimeCounters {  // saturate
  std::uint32_t late = 0;
  std::uint32_t early = 0;         // stamped ahead of the arrival
  std::uint32_t clock_jumped = 0;  // of a clock that seems to have been set, until that is confirmed
};

// Stamps of one sender: brought into the monotonic clock, and refused where they cannot be.
class SampleClock {
 public:
  struct Params {
    TimeBase base = TimeBase::kMonotonic;
    ClockOffset::Params offset{};
    std::int64_t most_age_ns = kNsPerS;          // at arrival
    std::int64_t most_ahead_ns = 10 * kNsPerMs;  // of the arrival
  };
  enum class Verdict : std::uint8_t { kGood, kLate, kEarly, kClockJumped };
  constexpr SampleClock() noexcept = default;
  explicit constexpr SampleClock(const Params& params) noexcept : params_(params), offset_(params.offset) {}

  // stamp_ns is written when the answer is kGood, and only then.
  [[nodiscard]] constexpr Verdict judge(std::int64_t sender_ns, std::int64_t arrival_ns,
                                        std::int64_t& stamp_ns) noexcept {
    std::optional<std::int64_t> mapped_ns = sender_ns;
    if (params_.base == TimeBase::kEstimated) mapped_ns = offset_.to_monotonic_ns(sender_ns, arrival_ns);
    if (!mapped_ns) return Verdict::kClockJumped;
    if (arrival_ns - *mapped_ns > params_.most_age_ns) return Verdict::kLate;
    if (*mapped_ns - arrival_ns > params_.most_ahead_ns) return Verdict::kEarly;
    stamp_ns = *mapped_ns;
    return Verdict::kGood;
  }
  // The same; a refusal is counted.
  [[nodiscard]] constexpr bool timely(std::int64_t sender_ns, std::int64_t arrival_ns, std::int64_t& stamp_ns,
                                      TimeCounters& counters) noexcept {
    const Verdict verdict = judge(sender_ns, arrival_ns, stamp_ns);
    if (verdict == Verdict::kLate) count_up(counters.late);
    if (verdict == Verdict::kEarly) count_up(counters.early);
    if (verdict == Verdict::kClockJumped) count_up(counters.clock_jumped);
    return verdict == Verdict::kGood;
  }
  constexpr void restart() noexcept { offset_.restart(); }
  [[nodiscard]] constexpr std::uint32_t restarts() const noexcept { return offset_.restarts(); }

 private:
  Params params_;
  ClockOffset offset_;
};

}  // namespace polygmap::hal
