// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/system/time_base.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
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

// A sender of 200 Hz whose packets take 1 ms; its clock began 30 s after this machine's.
struct Sender {
  static constexpr std::int64_t kBehind_ns = 30 * kNsPerS, kInterval_ns = 5 * kMs, kDelay_ns = 1 * kMs;
  SampleClock clock{{.base = TimeBase::kEstimated, .offset = {.least_delay_ns = kDelay_ns}}};
  std::int64_t now_ns = 100 * kNsPerS;  // when a sample is taken
  std::int64_t set_ns = 0;              // what its clock was set by
  TimeCounters counters;

  // Takes a sample whose packet is late by that much more, and whose time of arrival was told wrong by that. What the
  // stamp's error is, none when it was refused.
  std::optional<std::int64_t> send(std::int64_t late_ns = 0, std::int64_t arrival_off_ns = 0) {
    now_ns += kInterval_ns;
    std::int64_t stamp_ns = 0;
    const bool taken =
        clock.timely(now_ns - kBehind_ns + set_ns, now_ns + kDelay_ns + late_ns + arrival_off_ns, stamp_ns, counters);
    return taken ? std::optional(stamp_ns - now_ns) : std::nullopt;
  }
  void send_for(std::int64_t time_ns) {
    for (const std::int64_t end_ns = now_ns + time_ns; now_ns < end_ns;) EXPECT_EQ(send(), 0);
  }
};

TEST(ClockOffset, ToMonotonicNs_OneStampOff_IsRefusedAndMovesNoOther) {
  for (const std::int64_t set_ns : {21 * kMs, 100 * kMs, 400 * kMs, 30 * kNsPerS, -100 * kMs, -400 * kMs}) {
    Sender sender;
    sender.send_for(kNsPerS);
    sender.set_ns = set_ns;
    EXPECT_EQ(sender.send(), std::nullopt) << set_ns;
    sender.set_ns = 0;
    sender.send_for(5 * kNsPerS);
    EXPECT_EQ(sender.counters.clock_jumped, 1U);
    EXPECT_EQ(sender.clock.restarts(), 0U);
  }
}

TEST(ClockOffset, ToMonotonicNs_ClockSetEitherWay_IsBelievedWithin45Milliseconds) {
  for (const std::int64_t set_ns :
       {25 * kMs, 400 * kMs, 1'700'000'000 * kNsPerS, -25 * kMs, -400 * kMs, -20 * kNsPerS}) {
    Sender sender;
    sender.send_for(kNsPerS);
    sender.set_ns = set_ns;
    const std::int64_t set_at_ns = sender.now_ns;
    while (sender.now_ns < set_at_ns + 40 * kMs) {
      // Stamps that have passed the last one from before go on by the old offset; the gait sees no age of 0.1 s.
      const std::optional<std::int64_t> error_ns = sender.send();
      EXPECT_TRUE(!error_ns || std::abs(*error_ns) == 25 * kMs) << set_ns << " " << *error_ns;
    }
    sender.send_for(5 * kNsPerS);
    EXPECT_EQ(sender.clock.restarts(), 1U);
  }
}

TEST(ClockOffset, ToMonotonicNs_PacketsHeldUpAndDeliveredAtOnce_KeepTheirStamps) {
  for (const std::int64_t held_ns : {25 * kMs, 50 * kMs, 400 * kMs}) {
    Sender sender;
    sender.send_for(kNsPerS);
    const std::int64_t delivered_ns = sender.now_ns + held_ns;
    while (sender.now_ns < delivered_ns) {
      const std::int64_t taken_ns = sender.now_ns + Sender::kInterval_ns;
      EXPECT_EQ(sender.send(delivered_ns - taken_ns), 0) << held_ns;
    }
    sender.send_for(5 * kNsPerS);
    EXPECT_EQ(sender.counters.clock_jumped, 0U);
    EXPECT_EQ(sender.clock.restarts(), 0U);
  }
}

// Between a datagram's arrival and its reading, CLOCK_REALTIME was set: those of one cycle have a wrong arrival.
TEST(ClockOffset, ToMonotonicNs_RealtimeSetBetweenArrivalAndReading_MovesNoOther) {
  for (const std::int64_t off_ns : {-400 * kMs, 400 * kMs}) {
    Sender sender;
    sender.send_for(kNsPerS);
    (void)sender.send(0, off_ns);
    (void)sender.send(0, off_ns);
    sender.send_for(5 * kNsPerS);
    EXPECT_EQ(sender.clock.restarts(), 0U);
  }
}

TEST(ClockOffset, ToMonotonicNs_FirstPacketHeldUp_IsCorrected) {
  Sender sender;
  EXPECT_EQ(sender.send(50 * kMs), 50 * kMs) << "nothing says that it is late";
  for (int i = 0; i < 8; ++i) EXPECT_EQ(sender.send(), std::nullopt);
  sender.send_for(5 * kNsPerS);
}

TEST(SampleClock, Judge_PacketSecondsLate_IsLateAndForgotten) {
  Sender sender;
  sender.send_for(kNsPerS);
  EXPECT_EQ(sender.send(3 * kNsPerS), std::nullopt);
  EXPECT_EQ(sender.counters.late, 1U);
  sender.send_for(kNsPerS);
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
