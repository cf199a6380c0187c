// SPDX-License-Identifier: Apache-2.0
// What the executive measures: integers only, fixed size, no division in the cycle.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "scheduler/schedule_table.hpp"

namespace polygmap {

// Counts as far as it can and then stays there.
template <typename Unsigned>
constexpr void count_up(Unsigned& counter) noexcept {
  if (counter != std::numeric_limits<Unsigned>::max()) ++counter;
}

// Durations, ns: least, greatest, sum and a histogram with fixed edges.
class DurationStatistics {
 public:
  // Bucket 0 counts 0 ns, bucket b counts [2^(b-1), 2^b) ns; the last one everything from 2^(kBuckets-2) ns (4.19 ms).
  static constexpr std::size_t kBuckets = 24;
  [[nodiscard]] static constexpr std::size_t bucket_of(std::uint64_t duration_ns) noexcept {
    return std::min(static_cast<std::size_t>(std::bit_width(duration_ns)), kBuckets - 1);
  }
  // Least duration that the bucket counts.
  [[nodiscard]] static constexpr std::uint64_t bucket_low_ns(std::size_t bucket) noexcept {
    return bucket == 0 ? 0 : std::uint64_t{1} << (bucket - 1);
  }

  constexpr void add(std::uint64_t duration_ns) noexcept {
    count_up(count_);
    min_ns_ = std::min(min_ns_, duration_ns);
    max_ns_ = std::max(max_ns_, duration_ns);
    sum_ns_ += duration_ns;  // 2^64 ns are 584 years
    count_up(histogram_[bucket_of(duration_ns)]);
  }

  [[nodiscard]] constexpr std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] constexpr std::uint64_t min_ns() const noexcept { return count_ == 0 ? 0 : min_ns_; }
  [[nodiscard]] constexpr std::uint64_t max_ns() const noexcept { return max_ns_; }
  [[nodiscard]] constexpr std::uint64_t sum_ns() const noexcept { return sum_ns_; }
  [[nodiscard]] constexpr std::uint64_t mean_ns() const noexcept { return count_ == 0 ? 0 : sum_ns_ / count_; }
  [[nodiscard]] constexpr const std::array<std::uint32_t, kBuckets>& histogram() const noexcept { return histogram_; }

 private:
  std::uint64_t count_ = 0;
  std::uint64_t min_ns_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t max_ns_ = 0;
  std::uint64_t sum_ns_ = 0;
  std::array<std::uint32_t, kBuckets> histogram_{};
};

// One table row. Every slot of the row ends in exactly one of: runs, idle, shed, deferred (or in a slipped cycle).
struct RowStatistics {
  DurationStatistics time;           // of runs that had work
  std::uint64_t runs = 0;            // calls that returned kBusy or kDone
  std::uint64_t idle = 0;            // calls that returned kIdle
  std::uint64_t overruns = 0;        // calls longer than the row's budget
  std::uint64_t overrun_max_ns = 0;  // the longest of those calls
  // What runs that had work left of what they were given, leftovers of others among it; negative: an overrun.
  std::int64_t slack_min_ns = std::numeric_limits<std::int64_t>::max();
  std::int64_t slack_sum_ns = 0;
  std::uint64_t shed = 0;       // slots given up for lack of time
  std::uint64_t deferred = 0;   // slots that paid back an overdraft instead of working
  std::uint64_t overdrawn = 0;  // calls that spent more units than they were given
  std::uint64_t units = 0;      // work units spent
};

// One lane.
struct LaneStatistics {
  std::array<DurationStatistics, kCyclesPerMajor> slot_time;  // all rows of the cycle together, per slot
  DurationStatistics lateness;                                // from a cycle's due time to its tick
  std::uint64_t cycles = 0;                                   // cycles run
  std::uint64_t overruns = 0;                                 // cycles longer than kCycle_us
  std::uint64_t slips = 0;                                    // cycles skipped because the tick came too late
  std::uint64_t caught_up = 0;  // cycles run late, after the following one was already due
  std::uint64_t early = 0;      // ticks with no cycle due (too early, or before start)
};

// Converts differences of a free-running counter to ns without a division or floating point in the cycle.
class CounterScale {
 public:
  static constexpr double kMinRate_per_us = 1.0;
  static constexpr double kMaxRate_per_us = 10'000.0;
  [[nodiscard]] static constexpr bool valid(double counts_per_us) noexcept {
    return counts_per_us >= kMinRate_per_us && counts_per_us <= kMaxRate_per_us;  // false for NaN
  }
  // A rate outside the range counts as kMinRate_per_us.
  explicit constexpr CounterScale(double counts_per_us) noexcept
      : ns_per_count_q24_(static_cast<std::uint64_t>(
            1000.0 * static_cast<double>(kOne) / (valid(counts_per_us) ? counts_per_us : kMinRate_per_us) + 0.5)),
        max_count_((std::uint64_t{1} << 62) / ns_per_count_q24_) {}

  // Relative error at most 3e-7 (at 10 GHz); saturates at 2^38 ns (275 s).
  [[nodiscard]] constexpr std::uint64_t to_ns(std::uint64_t counts) const noexcept {
    return (std::min(counts, max_count_) * ns_per_count_q24_ + kOne / 2) / kOne;
  }

 private:
  static constexpr std::uint64_t kOne = std::uint64_t{1} << 24;
  std::uint64_t ns_per_count_q24_;
  std::uint64_t max_count_;
};

}  // namespace polygmap
