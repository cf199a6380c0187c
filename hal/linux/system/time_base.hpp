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
//
// A packet can be late, and then its stamp goes on from the last one's; it cannot be early. So a stamp ahead of what
// the offset allows, or one that went back, is that of a clock that was set (here or there), or a wrong one: it is
// refused until others have confirmed it, and moves the estimate only then. One that is late is taken, by the offset
// known; where all are late alike the clock was set, too.
class ClockOffset {
 public:
  struct Params {
    std::int64_t window_ns = 2 * kNsPerS;
    // What a stamp may be wrong until the window has passed: a fifth of the 0.1 s after which the gait stops for want
    // of news. Packets on a cable are delayed by some 1 ms more or less.
    std::int64_t jump_ns = 20 * kNsPerMs;
    // A clock was set when so many packets in a row, over so long by their arrival, agree to jump_ns. What waited
    // somewhere and arrives at once is no such row. A sender of 100 Hz or more is back well within that 0.1 s.
    std::uint32_t confirm = 5;
    std::int64_t confirm_ns = 40 * kNsPerMs;
    std::int64_t least_delay_ns = 0;  // of a sample, from its stamp to its arrival
  };
  constexpr ClockOffset() noexcept = default;
  explicit constexpr ClockOffset(const Params& params) noexcept : params_(params) {}

  // The stamp in the monotonic clock; none where the clock seems to have been set and that is not yet confirmed. Both
  // below 2^62.
  [[nodiscard]] constexpr std::optional<std::int64_t> to_monotonic_ns(std::int64_t sender_ns,
                                                                      std::int64_t arrival_ns) noexcept {
    const std::int64_t difference_ns = arrival_ns - sender_ns;
    if (known_) {
      const std::int64_t off_ns = difference_ns - least_ns();
      if (off_ns <= params_.jump_ns && off_ns >= -params_.jump_ns) {
        strange_.count = 0;
      } else if (!confirmed(difference_ns, arrival_ns)) {
        if (off_ns < 0 || sender_ns <= last_sender_ns_) return std::nullopt;
      } else {
        ++restarts_;
        begin(strange_.least_ns, arrival_ns);
      }
    } else {
      begin(difference_ns, arrival_ns);
    }
    last_sender_ns_ = sender_ns;
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

  constexpr void begin(std::int64_t difference_ns, std::int64_t arrival_ns) noexcept {
    known_ = true;
    strange_.count = 0;
    current_ns_ = previous_ns_ = difference_ns;
    window_begin_ns_ = arrival_ns;
  }
  // Counts one more strange packet in a row; true when the clock has been set.
  [[nodiscard]] constexpr bool confirmed(std::int64_t difference_ns, std::int64_t arrival_ns) noexcept {
    const std::int64_t least_ns = std::min(strange_.least_ns, difference_ns);
    const std::int64_t most_ns = std::max(strange_.most_ns, difference_ns);
    if (strange_.count == 0 || most_ns - least_ns > params_.jump_ns) {
      strange_ = {.count = 1, .least_ns = difference_ns, .most_ns = difference_ns, .begin_ns = arrival_ns};
    } else {
      strange_ = {strange_.count + 1, least_ns, most_ns, strange_.begin_ns};
    }
    return strange_.count >= params_.confirm && arrival_ns - strange_.begin_ns >= params_.confirm_ns;
  }

  Params params_;
  bool known_ = false;
  std::int64_t current_ns_ = 0;
  std::int64_t previous_ns_ = 0;
  std::int64_t window_begin_ns_ = 0;
  std::int64_t last_sender_ns_ = 0;
  struct {
    std::uint32_t count = 0;  // in a row
    std::int64_t least_ns = 0, most_ns = 0, begin_ns = 0;
  } strange_;
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
