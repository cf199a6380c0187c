// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/system/time_base.hpp"

#include <gtest/gtest.h>

#include <random>

namespace polygmap::hal {
namespace {

constexpr std::int64_t kMs = kNsPerMs;

TEST(ClockOffset, ToMonotonicNs_DelaysVary_ErrorIsThatOfTheFastest) {
  ClockOffset offset({.least_delay_ns = 1 * kMs});
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> delay_ns(1 * kMs, 9 * kMs);
  for (int i = 0; i < 4000; ++i) {
    const std::int64_t true_ns = 100 * kNsPerS + i * 5 * kMs;
    const auto mapped_ns = offset.to_monotonic_ns(true_ns - 77 * kNsPerS, true_ns + delay_ns(random));
    ASSERT_TRUE(mapped_ns);
    if (i >= 400) {  // a window has passed
      ASSERT_NEAR(static_cast<double>(*mapped_ns), static_cast<double>(true_ns), 0.3e6) << i;
    }
  }
}

TEST(ClockOffset, ToMonotonicNs_ClockDrifts_IsFollowed) {
  ClockOffset offset;
  for (int i = 0; i < 60'000; ++i) {  // five minutes at 200 Hz, the sender's clock 100 ppm fast
    const std::int64_t true_ns = i * 5 * kMs;
    const auto mapped_ns = offset.to_monotonic_ns(true_ns + true_ns / 10'000, true_ns);
    ASSERT_TRUE(mapped_ns);
    ASSERT_LE(std::abs(*mapped_ns - true_ns), kMs / 2) << i;
  }
}

TEST(ClockOffset, ToMonotonicNs_OnePacketSecondsLate_IsRefusedAndForgotten) {
  ClockOffset offset;
  ASSERT_TRUE(offset.to_monotonic_ns(0, 10 * kMs));
  EXPECT_FALSE(offset.to_monotonic_ns(1 * kMs, 3 * kNsPerS));
  EXPECT_EQ(offset.to_monotonic_ns(3 * kNsPerS, 3 * kNsPerS + 10 * kMs), 3 * kNsPerS + 10 * kMs);
  EXPECT_EQ(offset.restarts(), 0U);
}

TEST(ClockOffset, ToMonotonicNs_ClockSetEitherWay_BelievedOnceConfirmed) {
  for (const std::int64_t jump_ns : {-30 * kNsPerS, 1'700'000'000 * kNsPerS}) {
    ClockOffset offset({.confirm = 4});
    std::int64_t now_ns = 50 * kNsPerS;
    ASSERT_TRUE(offset.to_monotonic_ns(40 * kNsPerS, now_ns));
    for (int i = 1; i <= 6; ++i) {
      now_ns += 5 * kMs;
      const auto mapped_ns = offset.to_monotonic_ns(40 * kNsPerS + jump_ns + i * 5 * kMs, now_ns);
      EXPECT_EQ(mapped_ns.has_value(), i >= 4) << i;
      if (mapped_ns) {
        EXPECT_EQ(*mapped_ns, now_ns);
      }
    }
    EXPECT_EQ(offset.restarts(), 1U);
  }
}

TEST(SampleClock, Judge_MonotonicStamps_AgeBoundsHold) {
  SampleClock clock({.most_age_ns = 100, .most_ahead_ns = 10});
  std::int64_t stamp_ns = -1;
  EXPECT_EQ(clock.judge(899, 1000, stamp_ns), SampleClock::Verdict::kLate);
  EXPECT_EQ(clock.judge(1011, 1000, stamp_ns), SampleClock::Verdict::kEarly);
  EXPECT_EQ(stamp_ns, -1);
  EXPECT_EQ(clock.judge(900, 1000, stamp_ns), SampleClock::Verdict::kGood);
  EXPECT_EQ(stamp_ns, 900);
  EXPECT_EQ(clock.judge(1010, 1000, stamp_ns), SampleClock::Verdict::kGood);
}

TEST(ClockReading, ToMonotonicNs_StampOfTheRealtimeClock_KeepsItsAge) {
  const ClockReading reading{.monotonic_ns = 5000, .realtime_ns = 1'700'000'000'000, .good = true};
  EXPECT_EQ(reading.to_monotonic_ns(1'699'999'999'000), 4000);
}

}  // namespace
}  // namespace polygmap::hal
