// SPDX-License-Identifier: Apache-2.0
// Two lanes of one schedule, in turn and on two threads.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "algorithms/core/containers/exchange.hpp"
#include "scheduler/executive_event.hpp"
#include "tests/support/example_schedule.hpp"
#include "tests/support/fakes/fake_clock.hpp"

namespace polygmap {
namespace {

using fakes::FakeClock;
using namespace test;

TEST(CyclicExecutive, Tick_TwoLanes_EachRunsItsOwnRowsOnly) {
  FakeClock clock;
  RecordingTasks control, perception;
  Counters health;
  CyclicExecutive<RecordingTasks, kTable, 0> lane0(control, clock, health);
  CyclicExecutive<RecordingTasks, kTable, 1> lane1(perception, clock, health);
  lane0.start(0);
  lane1.start(0);
  for (std::int64_t i = 0; i < 16; ++i) {
    lane0.tick(i * kCycle_ns);
    lane1.tick(i * kCycle_ns);
  }
  for (const Call& call : control.calls) EXPECT_LE(call.row, kHealth);
  for (const Call& call : perception.calls) EXPECT_GE(call.row, kPlanes);
  EXPECT_EQ(control.calls.size(), 33U);
  EXPECT_EQ(perception.calls.size(), 24U);
  EXPECT_EQ(lane0.row_statistics(kPlanes).runs, 0U);
}

// Two lanes on two threads: perception hands its newest result to control, and its health to lane 0.
struct HandOver {
  std::int64_t stamp_ns = 0;
  std::array<std::int64_t, 63> payload{};
};
struct TwoLaneTasks {
  Exchange<HandOver, 4> planes;
  Exchange<Counters, 4> perception_health;
  Counters lane_health[2];
  std::int64_t newest_ns = -1;
  std::uint64_t taken = 0;
  std::uint64_t torn = 0;
  std::uint64_t backwards = 0;

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget&) noexcept {
    if (row == kPlanes) {
      HandOver& out = planes.back();
      out.stamp_ns = cycle_ns;
      out.payload.fill(cycle_ns);
      planes.publish(cycle_ns);
      lane_health[1].raise(ExecutiveEvent::kRowShed, cycle_ns);
      perception_health.back() = lane_health[1];
      perception_health.publish(cycle_ns);
    } else if (row == kControl) {
      if (!planes.try_take(cycle_ns)) return Progress::kIdle;
      const HandOver& in = planes.front();
      ++taken;
      if (in.stamp_ns <= newest_ns) ++backwards;
      newest_ns = in.stamp_ns;
      for (const std::int64_t value : in.payload) torn += value != in.stamp_ns ? 1U : 0U;
    }
    return Progress::kDone;
  }
  void cycle_done(std::size_t, const CycleReport&) noexcept {}  // the exchanges alone hand over
};

TEST(CyclicExecutive, Tick_TwoLanesOnTwoThreads_HandOverWholeValuesInOrder) {
  constexpr std::int64_t kCycles = 50'000;
  TwoLaneTasks tasks;
  FakeClock clock0, clock1;
  CyclicExecutive<TwoLaneTasks, kTable, 0> lane0(tasks, clock0, tasks.lane_health[0]);
  CyclicExecutive<TwoLaneTasks, kTable, 1> lane1(tasks, clock1, tasks.lane_health[1]);
  lane0.start(0);
  lane1.start(0);
  std::atomic<int> ready{0};
  const auto drive = [&ready](auto& lane, FakeClock& clock) {
    ready.fetch_add(1);
    while (ready.load() < 2) std::this_thread::yield();
    for (std::int64_t i = 0; i < kCycles; ++i) {
      lane.tick(clock.now_ns());
      clock.advance_ns(kCycle_ns);
      if (i % 64 == 0) std::this_thread::yield();
    }
  };
  std::thread control([&] { drive(lane0, clock0); });
  std::thread perception([&] { drive(lane1, clock1); });
  control.join();
  perception.join();
  WorkBudget none(0);
  (void)tasks.run_row(kControl, kCycles * kCycle_ns, none);  // takes what is left, if any
  EXPECT_EQ(tasks.torn, 0U);
  EXPECT_EQ(tasks.backwards, 0U);
  EXPECT_GT(tasks.taken, 0U);
  EXPECT_EQ(tasks.newest_ns, (kCycles - 1) * kCycle_ns) << "the last value is never lost";
  EXPECT_EQ(lane0.lane_statistics().cycles, static_cast<std::uint64_t>(kCycles));
  EXPECT_EQ(lane1.lane_statistics().cycles, static_cast<std::uint64_t>(kCycles));

  ASSERT_TRUE(tasks.perception_health.try_take(kCycles * kCycle_ns));
  Counters all = tasks.lane_health[0];
  all.merge(tasks.perception_health.front());
  EXPECT_EQ(all.count(ExecutiveEvent::kRowShed).count, static_cast<std::uint32_t>(kCycles));
}

}  // namespace
}  // namespace polygmap
