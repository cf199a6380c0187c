// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/system/posix_clock.hpp"

#include <gtest/gtest.h>

#include "sim_stub/heap_trap.hpp"
#include "tests/hal/linux/clock_now.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace contract {

struct PosixClockHarness {
  hal::PosixClock clock;
  PosixClockHarness() { EXPECT_FALSE(clock.open().failed()); }
  hal::Clock& port() { return clock; }
  void pass(std::int64_t duration_ns) {
    const std::int64_t end_ns = test::monotonic_now_ns() + duration_ns;
    while (test::monotonic_now_ns() < end_ns) {
    }
  }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(JointBusContract);  // of no driver: hal/can makes one of CAN channels
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(OperatorInputContract);  // of none either: the daemon has a socket
INSTANTIATE_TYPED_TEST_SUITE_P(Posix, ClockContract, PosixClockHarness);

}  // namespace contract

namespace {

TEST(PosixClock, Count_TenMilliseconds_ArePassedAtTheToldRate) {
  hal::PosixClock clock;
  ASSERT_FALSE(clock.open().failed());
  const std::uint64_t begin = clock.count();
  const std::int64_t begin_ns = clock.now_ns();
  while (clock.now_ns() - begin_ns < 10'000'000) {
  }
  const double counted_us = static_cast<double>(clock.count() - begin) / clock.counts_per_us();
  const double passed_us = static_cast<double>(clock.now_ns() - begin_ns) * 1e-3;
  EXPECT_GE(counted_us, 9'900.0);
  EXPECT_LE(counted_us, passed_us * 1.01 + 10.0);
}

TEST(PosixClock, NowNs_KernelRefuses_RepeatsTheLastAndCounts) {
  test::ScriptedCalls calls;
  hal::PosixClock clock(calls.table());
  ASSERT_FALSE(clock.open().failed());
  const std::int64_t last_ns = clock.now_ns();
  calls.fail(test::Call::kClockGettime, EINVAL, 2);
  EXPECT_EQ(clock.now_ns(), last_ns);
  EXPECT_EQ(clock.now_ns(), last_ns);
  EXPECT_EQ(clock.failed_calls(), 2U);
  EXPECT_GE(clock.now_ns(), last_ns);
}

TEST(PosixClock, Open_NoMonotonicClock_SaysWhy) {
  test::ScriptedCalls calls;
  hal::PosixClock clock(calls.table());
  calls.fail(test::Call::kClockGettime, EINVAL);
  EXPECT_STREQ(clock.open().sentence(), "clock: cannot read CLOCK_MONOTONIC: Invalid argument");
}

TEST(PosixClock, EveryReading_TouchesNoHeap) {
  hal::PosixClock clock;
  const heap::ModuleCall trap("PosixClock");
  EXPECT_GT(clock.now_ns(), 0);
  EXPECT_GT(clock.count(), 0U);
}

}  // namespace
}  // namespace polygmap
