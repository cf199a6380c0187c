// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "algorithms/core/exchange.hpp"
#include "scheduler/cyclic_executive.hpp"
#include "scheduler/health.hpp"
#include "scheduler/schedule_table.hpp"
#include "tests/support/fakes/fake_clock.hpp"

namespace polygmap {
namespace {

using fakes::FakeClock;

// An example of the table that the firmware owns: control in every slot, then resumable work in two lanes.
enum Row : std::size_t { kSense, kControl, kHealth, kPlanes, kFootholds };
constexpr ScheduleTable<5> kTable{{
    {.task = "sense", .lane = 0, .slots = kEverySlot, .budget_us = 100},
    {.task = "control", .lane = 0, .slots = kEverySlot, .budget_us = 400},
    {.task = "health", .lane = 0, .slots = slots_from(15, 16), .budget_us = 100},
    {.task = "planes", .lane = 1, .slots = kEverySlot, .budget_us = 800, .unit_cost_ns = 20, .shed_order = 1},
    {.task = "footholds", .lane = 1, .slots = slots_from(1, 2), .budget_us = 600, .unit_cost_ns = 150, .shed_order = 2},
}};
constexpr ScheduleTable<5> kOneLane = in_one_lane(kTable);

static_assert(lane_count(kTable) == 2 && lane_count(kOneLane) == 1);
static_assert(worst_minor_frame_us(kTable) == 1400);
static_assert(worst_minor_frame_us(kOneLane) == 2000);
static_assert(slot_load_us(kTable, 0, 15) == 600 && slot_load_us(kTable, 1, 0) == 800);
static_assert(kTable[kPlanes].units_per_slot() == 40'000 && kTable[kFootholds].units_per_slot() == 4000);
static_assert(!kTable[kControl].resumable() && kTable[kControl].units_per_slot() == 0);
static_assert(slots_from(1, 2) == 0xAAAA && slots_from(15, 16) == 0x8000 && slots_from(0, 1) == kEverySlot);
static_assert(slots_from(0, 0) == 0, "a stride of 0 is no slot, not an endless loop");

// Each check of the table, shown to fail on a table that breaks just its rule.
constexpr ScheduleTable<2> with(std::size_t row, ScheduleRow replacement) {
  ScheduleTable<2> table{{{.task = "a", .budget_us = 10}, {.task = "b", .budget_us = 10}}};
  table[row] = replacement;
  return table;
}
static_assert(rows_without_unique_name(with(1, {.task = "b", .budget_us = 10})) == 0);
static_assert(rows_without_unique_name(with(1, {.task = "a", .budget_us = 10})) == 1);
static_assert(rows_without_unique_name(with(1, {.task = "", .budget_us = 10})) == 1);
static_assert(rows_without_slot(with(1, {.task = "b", .slots = 0, .budget_us = 10})) == 1);
static_assert(rows_without_budget(with(1, {.task = "b", .budget_us = 0})) == 1);
static_assert(rows_without_budget(with(1, {.task = "b", .budget_us = -1})) == 1);
static_assert(rows_without_unit(with(1, {.task = "b", .budget_us = 10, .unit_cost_ns = 10'000})) == 0);
static_assert(rows_without_unit(with(1, {.task = "b", .budget_us = 10, .unit_cost_ns = 10'001})) == 1);
static_assert(rows_without_unit(with(1, {.task = "b", .budget_us = 10, .unit_cost_ns = -1})) == 1);
static_assert(rows_shed_but_not_resumable(with(1, {.task = "b", .budget_us = 10, .shed_order = 1})) == 1);
static_assert(rows_out_of_lane_order(with(1, {.task = "b", .lane = 1, .budget_us = 10})) == 0);
static_assert(rows_out_of_lane_order(with(1, {.task = "b", .lane = 2, .budget_us = 10})) == 1);
static_assert(rows_out_of_lane_order(with(0, {.task = "a", .lane = 1, .budget_us = 10})) == 2);
static_assert(worst_minor_frame_us(with(1, {.task = "b", .budget_us = 1991})) == 2001);

struct Call {
  std::size_t row;
  std::int64_t frame_ns;
  std::int32_t units;
};

// Records every call; `work` decides what a call does.
struct RecordingTasks {
  std::vector<Call> calls;
  std::vector<FrameReport> frames;
  std::function<Progress(const Call&, WorkBudget&)> work = [](const Call&, WorkBudget&) { return Progress::kDone; };

  Progress run_row(std::size_t row, std::int64_t frame_ns, WorkBudget& budget) noexcept {
    calls.push_back({row, frame_ns, budget.left()});
    return work(calls.back(), budget);
  }
  void frame_done(std::size_t, const FrameReport& report) noexcept { frames.push_back(report); }
};

class SingleLane : public ::testing::Test {
 protected:
  using Executive = CyclicExecutive<RecordingTasks, kOneLane>;
  static constexpr std::int64_t kStart_ns = 5'000'000'123;

  void SetUp() override { executive.start(kStart_ns); }
  // Ticks in time, frame after frame.
  void run(std::size_t frames) {
    for (std::size_t i = 0; i < frames; ++i) ASSERT_EQ(executive.tick(executive.next_due_ns()), 1U);
  }
  // The given row takes this long in its next call.
  void make_long(std::size_t row, double duration_us) {
    tasks.work = [this, row, duration_us, done = false](const Call& call, WorkBudget&) mutable {
      if (call.row == row && !done) {
        clock.work_us(duration_us);
        done = true;
      }
      return Progress::kDone;
    };
  }
  std::size_t calls_of(std::size_t row) const {
    return static_cast<std::size_t>(
        std::count_if(tasks.calls.begin(), tasks.calls.end(), [row](const Call& c) { return c.row == row; }));
  }

  FakeClock clock;
  RecordingTasks tasks;
  Health health;
  Executive executive{tasks, clock, health};
};

TEST_F(SingleLane, Tick_OneMajorFrame_RunsEveryRowOfEverySlotInTableOrder) {
  run(kMinorFramesPerMajor);
  std::size_t next = 0;
  for (std::size_t slot = 0; slot < kMinorFramesPerMajor; ++slot) {
    for (std::size_t row = 0; row < kOneLane.size(); ++row) {
      if (!kOneLane[row].runs_in(slot)) continue;
      ASSERT_LT(next, tasks.calls.size());
      EXPECT_EQ(tasks.calls[next].row, row);
      EXPECT_EQ(tasks.calls[next].frame_ns, kStart_ns + static_cast<std::int64_t>(slot) * kMinorFrame_ns);
      EXPECT_EQ(tasks.calls[next].units, kOneLane[row].units_per_slot());
      ++next;
    }
  }
  EXPECT_EQ(next, tasks.calls.size());
  EXPECT_EQ(executive.row_statistics(kSense).runs, 16U);
  EXPECT_EQ(executive.row_statistics(kHealth).runs, 1U);
  EXPECT_EQ(executive.row_statistics(kFootholds).runs, 8U);
  EXPECT_EQ(executive.lane_statistics().frames, 16U);
  EXPECT_FALSE(health.any_fault());
  EXPECT_FALSE(health.any_limit());
}

TEST_F(SingleLane, Tick_BeforeDueOrBeforeStart_RunsNothingAndCountsEarly) {
  EXPECT_EQ(executive.tick(kStart_ns - 1), 0U);
  EXPECT_EQ(executive.tick(kStart_ns), 1U);
  EXPECT_EQ(executive.tick(kStart_ns), 0U);
  EXPECT_EQ(executive.tick(kStart_ns + kMinorFrame_ns - 1), 0U);
  EXPECT_EQ(executive.lane_statistics().early, 3U);
  Executive idle(tasks, clock, health);
  EXPECT_EQ(idle.tick(kStart_ns), 0U);
  EXPECT_EQ(idle.lane_statistics().early, 1U);
}

TEST_F(SingleLane, Tick_LateWithinTheFrame_KeepsThePhaseAndRecordsTheLateness) {
  EXPECT_EQ(executive.tick(kStart_ns + 300'000), 1U);
  EXPECT_EQ(executive.tick(kStart_ns + kMinorFrame_ns), 1U);
  EXPECT_EQ(tasks.frames[0].due_ns, kStart_ns);
  EXPECT_EQ(tasks.frames[1].due_ns, kStart_ns + kMinorFrame_ns);
  EXPECT_EQ(executive.lane_statistics().lateness.max_ns(), 300'000U);
  EXPECT_EQ(executive.lane_statistics().lateness.min_ns(), 0U);
  EXPECT_EQ(executive.lane_statistics().slips, 0U);
}

TEST_F(SingleLane, Tick_TwoFramesLate_CatchesThemUp) {
  EXPECT_EQ(executive.tick(kStart_ns + 2 * kMinorFrame_ns), 3U);
  EXPECT_EQ(executive.lane_statistics().caught_up, 2U);
  EXPECT_EQ(executive.lane_statistics().slips, 0U);
  EXPECT_EQ(health.count(Limit::kFrameCaughtUp).count, 2U);
  EXPECT_EQ(health.count(Fault::kFrameSlip).count, 0U);
  EXPECT_EQ(calls_of(kControl), 3U);
  EXPECT_EQ(executive.shed_level(), 1U) << "late is short of time, whatever the reason";
  EXPECT_EQ(calls_of(kPlanes), 0U);
  EXPECT_EQ(executive.row_statistics(kPlanes).shed, 3U);
}

TEST_F(SingleLane, Tick_SevenFramesLate_SkipsFiveAndStaysInPhase) {
  EXPECT_EQ(executive.tick(kStart_ns + 7 * kMinorFrame_ns + 10), 3U);
  EXPECT_EQ(executive.lane_statistics().slips, 5U);
  EXPECT_EQ(executive.lane_statistics().caught_up, 2U);
  EXPECT_EQ(health.count(Fault::kFrameSlip).count, 5U);
  ASSERT_EQ(tasks.frames.size(), 3U);
  EXPECT_EQ(tasks.frames[0].frame, 5U);
  EXPECT_EQ(tasks.frames[0].skipped_before, 5U);
  EXPECT_EQ(tasks.frames[2].slot, 7U);
  EXPECT_EQ(tasks.frames[2].due_ns, kStart_ns + 7 * kMinorFrame_ns);
  EXPECT_EQ(tasks.frames[2].skipped_before, 0U);
  EXPECT_EQ(executive.next_due_ns(), kStart_ns + 8 * kMinorFrame_ns);
}

TEST_F(SingleLane, Tick_YearsLate_StaysBounded) {
  constexpr std::int64_t kThreeYears_ns = 94'608'000'000'000'000;
  EXPECT_EQ(executive.tick(kStart_ns + kThreeYears_ns), 3U);
  EXPECT_EQ(executive.lane_statistics().slips, static_cast<std::uint64_t>(kThreeYears_ns / kMinorFrame_ns - 2));
  EXPECT_EQ(health.count(Fault::kFrameSlip).count, UINT32_MAX);
}

TEST_F(SingleLane, Tick_ControlUsesTheSlack_ShedsThePerceptionRowThatNoLongerFits) {
  run(1);  // slot 1 is full: 100 + 400 + 800 + 600 us
  make_long(kControl, 800.0);
  run(1);
  EXPECT_EQ(tasks.frames.back().overran, 1U << kControl);
  EXPECT_EQ(tasks.frames.back().shed, 1U << kPlanes) << "footholds still fit and matter more";
  EXPECT_FALSE(tasks.frames.back().overrun);
  EXPECT_EQ(executive.row_statistics(kControl).overruns, 1U);
  EXPECT_EQ(executive.row_statistics(kPlanes).shed, 1U);
  EXPECT_EQ(health.count(Fault::kRowOverrun).count, 1U);
  EXPECT_EQ(health.count(Limit::kRowShed).count, 1U);
  EXPECT_EQ(health.count(Fault::kFrameOverrun).count, 0U);
  EXPECT_EQ(executive.shed_level(), 0U);
  run(1);
  EXPECT_EQ(tasks.frames.back().shed, 0U);
}

TEST_F(SingleLane, Tick_WorkExactlyAtItsBounds_IsNeitherOverrunNorShed) {
  const auto next_odd_frame = [this](std::size_t row, double duration_us) {  // 100 + 400 + 800 + 600 us
    run(1);
    make_long(row, duration_us);
    run(1);
    return tasks.frames.back();
  };
  EXPECT_EQ(next_odd_frame(kControl, 400.0).overran, 0U);
  EXPECT_EQ(next_odd_frame(kControl, 400.001).overran, 1U << kControl);
  EXPECT_EQ(next_odd_frame(kControl, 620.0).shed, 0U) << "with 800 + 600 us the frame and the dispatch allowance";
  EXPECT_EQ(next_odd_frame(kControl, 620.001).shed, 1U << kPlanes);
  EXPECT_FALSE(next_odd_frame(kFootholds, 2000.0).overrun);
  EXPECT_TRUE(next_odd_frame(kFootholds, 2000.001).overrun);
}

TEST_F(SingleLane, Tick_OverrunWhileRecovering_StartsTheRecoveryAnew) {
  make_long(kSense, 2500.0);
  run(1);
  run(Executive::kRecoveryFrames - 1);
  make_long(kSense, 2500.0);
  run(1);
  EXPECT_EQ(executive.shed_level(), 2U);
  run(Executive::kRecoveryFrames - 1);
  EXPECT_EQ(executive.shed_level(), 2U);
  run(1);
  EXPECT_EQ(executive.shed_level(), 1U);
  run(Executive::kRecoveryFrames - 1);
  EXPECT_EQ(executive.shed_level(), 1U);
  run(1);
  EXPECT_EQ(executive.shed_level(), 0U);
}

TEST_F(SingleLane, Tick_FrameOverrun_ShedsTheFirstOrderUntilAMajorFrameWentWell) {
  run(1);
  make_long(kFootholds, 2500.0);
  run(1);
  EXPECT_TRUE(tasks.frames.back().overrun);
  EXPECT_EQ(executive.lane_statistics().overruns, 1U);
  EXPECT_EQ(health.count(Fault::kFrameOverrun).count, 1U);
  EXPECT_EQ(executive.shed_level(), 1U);
  const std::size_t planes_before = calls_of(kPlanes);
  const std::size_t control_before = calls_of(kControl);
  run(Executive::kRecoveryFrames);
  EXPECT_EQ(calls_of(kPlanes), planes_before);
  EXPECT_EQ(calls_of(kControl), control_before + Executive::kRecoveryFrames);
  EXPECT_EQ(executive.row_statistics(kPlanes).shed, Executive::kRecoveryFrames);
  EXPECT_EQ(executive.shed_level(), 0U);
  run(1);
  EXPECT_EQ(calls_of(kPlanes), planes_before + 1);
}

TEST_F(SingleLane, Tick_OverrunsEveryFrame_ShedsAllPerceptionAndNeverControl) {
  tasks.work = [this](const Call& call, WorkBudget&) {
    if (call.row == kSense) clock.work_us(2100.0);
    return Progress::kDone;
  };
  run(32);
  EXPECT_EQ(executive.shed_level(), 2U);
  EXPECT_EQ(calls_of(kSense), 32U);
  EXPECT_EQ(calls_of(kControl), 32U);
  EXPECT_EQ(calls_of(kHealth), 2U);
  EXPECT_EQ(calls_of(kPlanes), 0U);
  EXPECT_EQ(calls_of(kFootholds), 0U);
  EXPECT_EQ(executive.lane_statistics().overruns, 32U);
  EXPECT_EQ(executive.row_statistics(kFootholds).shed, 16U);
}

TEST_F(SingleLane, ShedInNextFrame_Mask_ShedsThoseRowsOnceButNeverControl) {
  executive.shed_in_next_frame(1U << kPlanes | 1U << kControl);
  run(1);
  EXPECT_EQ(tasks.frames.back().shed, 1U << kPlanes);
  EXPECT_EQ(calls_of(kControl), 1U);
  run(1);
  EXPECT_EQ(tasks.frames.back().shed, 0U);
}

TEST_F(SingleLane, RunRow_RecordedShedsReplayed_GivesTheSameCalls) {
  tasks.work = [this](const Call& call, WorkBudget& budget) {
    budget.spend(call.units + static_cast<std::int32_t>(call.frame_ns % 7));
    if (call.row == kControl && call.frame_ns / kMinorFrame_ns % 5 == 0) clock.work_us(1200.0);
    return Progress::kBusy;
  };
  run(64);
  RecordingTasks replayed;
  replayed.work = [](const Call& call, WorkBudget& budget) {
    budget.spend(call.units + static_cast<std::int32_t>(call.frame_ns % 7));
    return Progress::kBusy;
  };
  Health replay_health;
  CyclicExecutive<RecordingTasks, kOneLane> replay(replayed, clock, replay_health);
  replay.start(kStart_ns);
  std::size_t shed = 0;
  for (const FrameReport& frame : tasks.frames) {
    shed += frame.shed != 0 ? 1U : 0U;
    replay.shed_in_next_frame(frame.shed);
    ASSERT_EQ(replay.tick(frame.due_ns), 1U);
  }
  EXPECT_GT(shed, 5U);
  ASSERT_EQ(replayed.calls.size(), tasks.calls.size());
  for (std::size_t i = 0; i < tasks.calls.size(); ++i) {
    ASSERT_EQ(replayed.calls[i].row, tasks.calls[i].row);
    ASSERT_EQ(replayed.calls[i].units, tasks.calls[i].units);
    ASSERT_EQ(replayed.calls[i].frame_ns, tasks.calls[i].frame_ns);
  }
}

TEST_F(SingleLane, RunRow_Idle_CountsIdleAndKeepsItOutOfTheTimes) {
  tasks.work = [this](const Call& call, WorkBudget&) {
    clock.work_us(1.0);
    return call.row == kPlanes ? Progress::kIdle : Progress::kDone;
  };
  run(4);
  EXPECT_EQ(executive.row_statistics(kPlanes).idle, 4U);
  EXPECT_EQ(executive.row_statistics(kPlanes).runs, 0U);
  EXPECT_EQ(executive.row_statistics(kPlanes).time.count(), 0U);
  EXPECT_EQ(executive.row_statistics(kControl).time.count(), 4U);
}

TEST_F(SingleLane, RunRow_Times_GiveMinMeanMaxAndHistogramPerRowAndSlot) {
  tasks.work = [this, n = 0](const Call& call, WorkBudget&) mutable {
    if (call.row == kControl) clock.work_us(100.0 * ++n);
    return Progress::kDone;
  };
  run(3);
  const DurationStatistics& time = executive.row_statistics(kControl).time;
  EXPECT_EQ(time.min_ns(), 100'000U);
  EXPECT_EQ(time.mean_ns(), 200'000U);
  EXPECT_EQ(time.max_ns(), 300'000U);
  EXPECT_EQ(time.histogram()[DurationStatistics::bucket_of(100'000)], 1U);
  EXPECT_EQ(time.histogram()[DurationStatistics::bucket_of(200'000)], 1U);
  EXPECT_EQ(time.histogram()[DurationStatistics::bucket_of(300'000)], 1U);
  EXPECT_EQ(executive.lane_statistics().slot_time[2].max_ns(), 300'000U);
  EXPECT_EQ(executive.lane_statistics().slot_time[3].count(), 0U);
  EXPECT_EQ(executive.row_statistics(kControl).overruns, 0U);
}

TEST_F(SingleLane, RunRow_CycleCounterWrapsAround_TimesStayRight) {
  clock.advance_cycles(UINT64_MAX - 1000);
  make_long(kControl, 150.0);
  run(1);
  EXPECT_EQ(executive.row_statistics(kControl).time.max_ns(), 150'000U);
}

TEST_F(SingleLane, RunRow_Overdraft_IsPaidBackByTheFollowingSlots) {
  constexpr std::int32_t kUnits = kOneLane[kPlanes].units_per_slot();
  tasks.work = [piece = 5 * kUnits / 2](const Call& call, WorkBudget& budget) {
    if (call.row == kPlanes) budget.spend(piece);  // one indivisible piece of two and a half slots
    return Progress::kBusy;
  };
  run(10);
  std::vector<std::int32_t> allowances;
  for (const Call& call : tasks.calls) {
    if (call.row == kPlanes) allowances.push_back(call.units);
  }
  EXPECT_EQ(allowances, (std::vector<std::int32_t>{kUnits, kUnits / 2, kUnits, kUnits / 2}));
  EXPECT_EQ(executive.row_statistics(kPlanes).deferred, 6U);
  EXPECT_EQ(executive.row_statistics(kPlanes).overdrawn, 4U);
  EXPECT_EQ(executive.row_statistics(kPlanes).units, static_cast<std::uint64_t>(10 * kUnits));
  EXPECT_EQ(health.count(Limit::kRowDeferred).count, 6U);
}

TEST_F(SingleLane, RunRow_ShedWhileOverdrawn_PaysWithTheShedSlot) {
  constexpr std::int32_t kUnits = kOneLane[kPlanes].units_per_slot();
  tasks.work = [](const Call& call, WorkBudget& budget) {
    if (call.row == kPlanes) budget.spend(2 * kUnits);
    return Progress::kBusy;
  };
  run(1);
  executive.shed_in_next_frame(1U << kPlanes);
  run(2);
  EXPECT_EQ(executive.row_statistics(kPlanes).deferred, 0U);
  EXPECT_EQ(tasks.calls.back().row, kPlanes);
  EXPECT_EQ(tasks.calls.back().units, kUnits);
}

TEST_F(SingleLane, RunRow_EverySlotOfARow_IsRunIdleShedDeferredOrSlipped) {
  std::uint32_t random = 1;
  tasks.work = [this, &random](const Call& call, WorkBudget& budget) {
    random = random * 1664525U + 1013904223U;
    const std::uint32_t dice = random >> 16;
    if (dice % 37 == 0) clock.work_us(dice % 3000);
    if (call.units > 0) budget.spend(static_cast<std::int32_t>(dice % 3) * call.units);
    return static_cast<Progress>(dice % 3);
  };
  std::int64_t now_ns = kStart_ns;
  for (int i = 0; i < 20'000; ++i) {
    random = random * 1664525U + 1013904223U;
    now_ns += (random >> 16) % 64 == 0 ? 9 * kMinorFrame_ns : kMinorFrame_ns;
    executive.tick(now_ns);
  }
  const LaneStatistics& lane = executive.lane_statistics();
  EXPECT_GT(lane.slips, 100U);
  const RowStatistics& planes = executive.row_statistics(kPlanes);  // in every slot
  EXPECT_EQ(planes.runs + planes.idle + planes.shed + planes.deferred, lane.frames);
  const RowStatistics& control = executive.row_statistics(kControl);
  EXPECT_EQ(control.runs + control.idle, lane.frames);
  EXPECT_EQ(lane.frames + lane.slips, static_cast<std::uint64_t>((now_ns - kStart_ns) / kMinorFrame_ns + 1));
  for (const std::uint64_t seen : {planes.shed, planes.deferred, planes.overruns, planes.idle, lane.overruns}) {
    EXPECT_GT(seen, 100U);
  }
}

TEST(CyclicExecutive, Start_ClockRateOutOfRange_RaisesTheFault) {
  for (const double rate : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    FakeClock clock(rate);
    RecordingTasks tasks;
    Health health;
    CyclicExecutive<RecordingTasks, kOneLane> executive(tasks, clock, health);
    executive.start(0);
    EXPECT_EQ(health.count(Fault::kClockRate).count, 1U);
    EXPECT_EQ(executive.tick(0), 1U);
  }
}

// The row that matters more stands first: it may use the time of the one that is shed before it.
constexpr ScheduleTable<3> kImportantFirst{{
    {.task = "control", .budget_us = 500},
    {.task = "footholds", .budget_us = 600, .unit_cost_ns = 150, .shed_order = 2},
    {.task = "planes", .budget_us = 800, .unit_cost_ns = 20, .shed_order = 1},
}};
TEST(CyclicExecutive, Tick_ShortOfTimeBeforeTheMoreImportantRow_ShedsTheOtherOne) {
  FakeClock clock;
  RecordingTasks tasks;
  Health health;
  CyclicExecutive<RecordingTasks, kImportantFirst> executive(tasks, clock, health);
  tasks.work = [&clock](const Call& call, WorkBudget&) {
    clock.work_us(call.row == 0 ? 1000.0 : 590.0);
    return Progress::kDone;
  };
  executive.start(0);
  executive.tick(0);
  EXPECT_EQ(executive.last_frame().ran, 0b011U);
  EXPECT_EQ(executive.last_frame().shed, 0b100U);
}

TEST(CyclicExecutive, Tick_TwoLanes_EachRunsItsOwnRowsOnly) {
  FakeClock clock;
  RecordingTasks control, perception;
  Health health;
  CyclicExecutive<RecordingTasks, kTable, 0> lane0(control, clock, health);
  CyclicExecutive<RecordingTasks, kTable, 1> lane1(perception, clock, health);
  lane0.start(0);
  lane1.start(0);
  for (std::int64_t i = 0; i < 16; ++i) {
    lane0.tick(i * kMinorFrame_ns);
    lane1.tick(i * kMinorFrame_ns);
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
  Exchange<HandOver> planes;
  Exchange<Health> perception_health;
  Health lane_health[2];
  std::int64_t newest_ns = -1;
  std::uint64_t taken = 0;
  std::uint64_t torn = 0;
  std::uint64_t backwards = 0;

  Progress run_row(std::size_t row, std::int64_t frame_ns, WorkBudget&) noexcept {
    if (row == kPlanes) {
      HandOver& out = planes.back();
      out.stamp_ns = frame_ns;
      out.payload.fill(frame_ns);
      planes.publish();
      lane_health[1].raise(Limit::kPlanesFull, frame_ns);
      perception_health.back() = lane_health[1];
      perception_health.publish();
    } else if (row == kControl) {
      if (!planes.try_take()) return Progress::kIdle;
      const HandOver& in = planes.front();
      ++taken;
      if (in.stamp_ns <= newest_ns) ++backwards;
      newest_ns = in.stamp_ns;
      for (const std::int64_t value : in.payload) torn += value != in.stamp_ns ? 1U : 0U;
    }
    return Progress::kDone;
  }
};

TEST(CyclicExecutive, Tick_TwoLanesOnTwoThreads_HandOverWholeValuesInOrder) {
  constexpr std::int64_t kFrames = 50'000;
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
    for (std::int64_t i = 0; i < kFrames; ++i) {
      lane.tick(clock.now_ns());
      clock.advance_ns(kMinorFrame_ns);
      if (i % 64 == 0) std::this_thread::yield();
    }
  };
  std::thread control([&] { drive(lane0, clock0); });
  std::thread perception([&] { drive(lane1, clock1); });
  control.join();
  perception.join();
  WorkBudget none(0);
  (void)tasks.run_row(kControl, kFrames * kMinorFrame_ns, none);  // takes what is left, if any
  EXPECT_EQ(tasks.torn, 0U);
  EXPECT_EQ(tasks.backwards, 0U);
  EXPECT_GT(tasks.taken, 0U);
  EXPECT_EQ(tasks.newest_ns, (kFrames - 1) * kMinorFrame_ns) << "the last value is never lost";
  EXPECT_EQ(lane0.lane_statistics().frames, static_cast<std::uint64_t>(kFrames));
  EXPECT_EQ(lane1.lane_statistics().frames, static_cast<std::uint64_t>(kFrames));

  ASSERT_TRUE(tasks.perception_health.try_take());
  Health all = tasks.lane_health[0];
  all.merge(tasks.perception_health.front());
  EXPECT_EQ(all.count(Limit::kPlanesFull).count, static_cast<std::uint32_t>(kFrames));
}

TEST(DurationStatistics, BucketOf_PowersOfTwo_StartsANewBucketAtEach) {
  EXPECT_EQ(DurationStatistics::bucket_of(0), 0U);
  for (std::size_t b = 1; b < DurationStatistics::kBuckets; ++b) {
    const std::uint64_t low = DurationStatistics::bucket_low_ns(b);
    EXPECT_EQ(DurationStatistics::bucket_of(low), b);
    EXPECT_EQ(DurationStatistics::bucket_of(low - 1), b - 1);
  }
  EXPECT_EQ(DurationStatistics::bucket_of(UINT64_MAX), DurationStatistics::kBuckets - 1);
}

TEST(DurationStatistics, Add_Nothing_IsAllZero) {
  const DurationStatistics statistics;
  EXPECT_EQ(statistics.min_ns(), 0U);
  EXPECT_EQ(statistics.mean_ns(), 0U);
  EXPECT_EQ(statistics.max_ns(), 0U);
}

TEST(DurationStatistics, Add_ManyValues_HistogramHoldsThemAll) {
  DurationStatistics statistics;
  for (std::uint64_t ns = 0; ns < 10'000; ++ns) statistics.add(ns);
  std::uint64_t total = 0;
  for (const std::uint32_t n : statistics.histogram()) total += n;
  EXPECT_EQ(total, 10'000U);
  EXPECT_EQ(statistics.count(), 10'000U);
  EXPECT_EQ(statistics.mean_ns(), 4999U);
  EXPECT_EQ(statistics.histogram()[4], 8U);  // 8 to 15 ns
}

TEST(CountUp, AtTheTop_Stays) {
  std::uint8_t n = 254;
  count_up(n);
  count_up(n);
  EXPECT_EQ(n, 255);
}

TEST(CycleScale, ToNs_RatesOfRealCounters_IsExactToAPartInAMillion) {
  for (const double rate : {1.0, 19.2, 31.25, 1000.0, 2496.0, 10'000.0}) {
    const CycleScale scale(rate);
    for (const std::uint64_t us : {1U, 100U, 2000U, 1'000'000U}) {
      const auto cycles = static_cast<std::uint64_t>(static_cast<double>(us) * rate);
      const double expected_ns = static_cast<double>(cycles) * 1000.0 / rate;
      EXPECT_NEAR(static_cast<double>(scale.to_ns(cycles)), expected_ns, 0.51 + 1e-6 * expected_ns) << rate;
    }
  }
}

TEST(CycleScale, ToNs_Anything_SaturatesInsteadOfWrapping) {
  for (const double rate : {1.0, 2496.0, 10'000.0}) {
    const CycleScale scale(rate);
    EXPECT_GT(scale.to_ns(UINT64_MAX), std::uint64_t{200'000'000'000});
    EXPECT_EQ(scale.to_ns(UINT64_MAX), scale.to_ns(UINT64_MAX / 2));
  }
}

template <typename Code>
class HealthCodes : public ::testing::Test {
 public:
  static Code at(std::size_t i) { return static_cast<Code>(kFirstCode<Code> + i); }
};
using CodeTypes = ::testing::Types<Fault, Limit>;
TYPED_TEST_SUITE(HealthCodes, CodeTypes);

TYPED_TEST(HealthCodes, Raise_EachCode_CountsThatOneAlone) {
  for (std::size_t i = 0; i < kCodeCount<TypeParam>; ++i) {
    Health health;
    health.raise(this->at(i), 10);
    health.raise(this->at(i), 30);
    for (std::size_t j = 0; j < kCodeCount<TypeParam>; ++j) {
      EXPECT_EQ(health.count(this->at(j)).count, i == j ? 2U : 0U);
    }
    EXPECT_EQ(health.count(this->at(i)).first_ns, 10);
    EXPECT_EQ(health.count(this->at(i)).last_ns, 30);
    EXPECT_EQ(health.any_fault(), (std::is_same_v<TypeParam, Fault>));
    EXPECT_EQ(health.any_limit(), (std::is_same_v<TypeParam, Limit>));
    health.clear(this->at(i));
    EXPECT_EQ(health.count(this->at(i)).count, 0U);
    EXPECT_FALSE(health.any_fault() || health.any_limit());
  }
}

TYPED_TEST(HealthCodes, NameOf_EachCode_IsItsOwn) {
  for (std::size_t i = 0; i < kCodeCount<TypeParam>; ++i) {
    EXPECT_FALSE(name_of(this->at(i)).empty());
    EXPECT_NE(name_of(this->at(i)), "unknown");
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(name_of(this->at(i)), name_of(this->at(j)));
  }
  EXPECT_EQ(name_of(TypeParam::kEnd), "unknown");
  EXPECT_EQ(name_of(static_cast<TypeParam>(0)), "unknown");
}

TYPED_TEST(HealthCodes, Raise_OutsideTheEnumeration_ChangesNothing) {
  Health health;
  for (const int code : {0, static_cast<int>(TypeParam::kEnd), 255}) {
    health.raise(static_cast<TypeParam>(code), 1);
    EXPECT_EQ(health.count(static_cast<TypeParam>(code)).count, 0U);
  }
  EXPECT_FALSE(health.any_fault() || health.any_limit());
}

TYPED_TEST(HealthCodes, Raise_ManyTimes_Saturates) {
  Health health;
  health.raise(this->at(0), 1, UINT32_MAX - 1);
  health.raise(this->at(0), 2, 5);
  EXPECT_EQ(health.count(this->at(0)).count, UINT32_MAX);
  health.raise(this->at(1), 3, 0);
  EXPECT_EQ(health.count(this->at(1)).count, 0U);
}

TYPED_TEST(HealthCodes, Merge_TwoLanes_AddsCountsAndWidensTheStamps) {
  Health a, b;
  a.raise(this->at(0), 10);
  b.raise(this->at(0), 5, 2);
  b.raise(this->at(1), 7);
  a.merge(b);
  EXPECT_EQ(a.count(this->at(0)).count, 3U);
  EXPECT_EQ(a.count(this->at(0)).first_ns, 5);
  EXPECT_EQ(a.count(this->at(0)).last_ns, 10);
  EXPECT_EQ(a.count(this->at(1)).first_ns, 7);
  a.clear();
  EXPECT_FALSE(a.any_fault() || a.any_limit());
}

TEST(HealthCodesApart, FaultsAndLimits_ShareNoNumber) {
  EXPECT_LT(static_cast<int>(Fault::kEnd), 100);
  EXPECT_GT(static_cast<int>(Limit::kRowShed), 100);
}

}  // namespace
}  // namespace polygmap
