// SPDX-License-Identifier: Apache-2.0
// The table's checks; one lane: phase, catching up, shedding, overdrafts, statistics.
#include <gtest/gtest.h>

#include "scheduler/executive_event.hpp"
#include "tests/support/example_schedule.hpp"
#include "tests/support/fakes/fake_clock.hpp"

namespace polygmap {
namespace {

using fakes::FakeClock;
using namespace test;

static_assert(lane_count(kTable) == 2 && lane_count(kOneLane) == 1);
static_assert(worst_cycle_us(kTable) == 1400);
static_assert(worst_cycle_us(kOneLane) == 2000);
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
static_assert(worst_cycle_us(with(1, {.task = "b", .budget_us = 1991})) == 2001);

class SingleLane : public ::testing::Test {
 protected:
  using Executive = CyclicExecutive<RecordingTasks, kOneLane>;
  static constexpr std::int64_t kStart_ns = 5'000'000'123;

  void SetUp() override { executive.start(kStart_ns); }
  // Ticks in time, cycle after cycle.
  void run(std::size_t cycles) {
    for (std::size_t i = 0; i < cycles; ++i) ASSERT_EQ(executive.tick(executive.next_due_ns()), 1U);
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
  Counters health;
  Executive executive{tasks, clock, health};
};

TEST_F(SingleLane, Tick_OneMajorCycle_RunsEveryRowOfEverySlotInTableOrder) {
  run(kCyclesPerMajor);
  std::size_t next = 0;
  for (std::size_t slot = 0; slot < kCyclesPerMajor; ++slot) {
    for (std::size_t row = 0; row < kOneLane.size(); ++row) {
      if (!kOneLane[row].runs_in(slot)) continue;
      ASSERT_LT(next, tasks.calls.size());
      EXPECT_EQ(tasks.calls[next].row, row);
      EXPECT_EQ(tasks.calls[next].cycle_ns, kStart_ns + static_cast<std::int64_t>(slot) * kCycle_ns);
      EXPECT_EQ(tasks.calls[next].units, kOneLane[row].units_per_slot());
      ++next;
    }
  }
  EXPECT_EQ(next, tasks.calls.size());
  EXPECT_EQ(executive.row_statistics(kSense).runs, 16U);
  EXPECT_EQ(executive.row_statistics(kHealth).runs, 1U);
  EXPECT_EQ(executive.row_statistics(kFootholds).runs, 8U);
  EXPECT_EQ(executive.lane_statistics().cycles, 16U);
  EXPECT_FALSE(health.any<ExecutiveEvent>());
}

TEST_F(SingleLane, Tick_BeforeDueOrBeforeStart_RunsNothingAndCountsEarly) {
  EXPECT_EQ(executive.tick(kStart_ns - 1), 0U);
  EXPECT_EQ(executive.tick(kStart_ns), 1U);
  EXPECT_EQ(executive.tick(kStart_ns), 0U);
  EXPECT_EQ(executive.tick(kStart_ns + kCycle_ns - 1), 0U);
  EXPECT_EQ(executive.lane_statistics().early, 3U);
  Executive idle(tasks, clock, health);
  EXPECT_EQ(idle.tick(kStart_ns), 0U);
  EXPECT_EQ(idle.lane_statistics().early, 1U);
}

TEST_F(SingleLane, Tick_LateWithinTheCycle_KeepsThePhaseAndRecordsTheLateness) {
  EXPECT_EQ(executive.tick(kStart_ns + 300'000), 1U);
  EXPECT_EQ(executive.tick(kStart_ns + kCycle_ns), 1U);
  EXPECT_EQ(tasks.cycles[0].due_ns, kStart_ns);
  EXPECT_EQ(tasks.cycles[1].due_ns, kStart_ns + kCycle_ns);
  EXPECT_EQ(executive.lane_statistics().lateness.max_ns(), 300'000U);
  EXPECT_EQ(executive.lane_statistics().lateness.min_ns(), 0U);
  EXPECT_EQ(executive.lane_statistics().slips, 0U);
}

TEST_F(SingleLane, Tick_TwoCyclesLate_CatchesThemUp) {
  EXPECT_EQ(executive.tick(kStart_ns + 2 * kCycle_ns), 3U);
  EXPECT_EQ(executive.lane_statistics().caught_up, 2U);
  EXPECT_EQ(executive.lane_statistics().slips, 0U);
  EXPECT_EQ(health.count(ExecutiveEvent::kCycleCaughtUp).count, 2U);
  EXPECT_EQ(health.count(ExecutiveEvent::kCycleSlip).count, 0U);
  EXPECT_EQ(calls_of(kControl), 3U);
  EXPECT_EQ(executive.shed_level(), 1U) << "late is short of time, whatever the reason";
  EXPECT_EQ(calls_of(kPlanes), 0U);
  EXPECT_EQ(executive.row_statistics(kPlanes).shed, 3U);
}

constexpr ScheduleTable<2> kActing{
    {{.task = "plan", .budget_us = 100}, {.task = "act", .budget_us = 100, .newest_only = true}}};
static_assert(rows_newest_only_but_resumable(kActing) == 0);
static_assert(rows_newest_only_but_resumable(
                  with(1, {.task = "b", .budget_us = 10, .unit_cost_ns = 10, .newest_only = true})) == 1);

TEST(NewestOnlyRow, TickLate_RunsInTheNewestCycleAlone) {
  FakeClock clock;
  RecordingTasks tasks;
  Counters health;
  CyclicExecutive<RecordingTasks, kActing> executive(tasks, clock, health);
  executive.start(0);
  for (const std::int64_t late_cycles : {0, 1, 2, 30}) {
    tasks.calls.clear();
    const std::int64_t newest_ns = executive.next_due_ns() + late_cycles * kCycle_ns;
    executive.tick(newest_ns + 1);
    std::size_t acted = 0;
    for (const Call& call : tasks.calls) {
      if (call.row != 1) continue;
      ++acted;
      EXPECT_EQ(call.cycle_ns, newest_ns);
    }
    EXPECT_EQ(acted, 1U) << late_cycles;
    EXPECT_EQ(tasks.calls.size() - acted, static_cast<std::size_t>(std::min<std::int64_t>(late_cycles, 2) + 1));
  }
}

TEST_F(SingleLane, Tick_SevenCyclesLate_SkipsFiveAndStaysInPhase) {
  EXPECT_EQ(executive.tick(kStart_ns + 7 * kCycle_ns + 10), 3U);
  EXPECT_EQ(executive.lane_statistics().slips, 5U);
  EXPECT_EQ(executive.lane_statistics().caught_up, 2U);
  EXPECT_EQ(health.count(ExecutiveEvent::kCycleSlip).count, 5U);
  ASSERT_EQ(tasks.cycles.size(), 3U);
  EXPECT_EQ(tasks.cycles[0].cycle, 5U);
  EXPECT_EQ(tasks.cycles[0].skipped_before, 5U);
  EXPECT_EQ(tasks.cycles[2].slot, 7U);
  EXPECT_EQ(tasks.cycles[2].due_ns, kStart_ns + 7 * kCycle_ns);
  EXPECT_EQ(tasks.cycles[2].skipped_before, 0U);
  EXPECT_EQ(executive.next_due_ns(), kStart_ns + 8 * kCycle_ns);
}

TEST_F(SingleLane, Tick_YearsLate_StaysBounded) {
  constexpr std::int64_t kThreeYears_ns = 94'608'000'000'000'000;
  EXPECT_EQ(executive.tick(kStart_ns + kThreeYears_ns), 3U);
  EXPECT_EQ(executive.lane_statistics().slips, static_cast<std::uint64_t>(kThreeYears_ns / kCycle_ns - 2));
  EXPECT_EQ(health.count(ExecutiveEvent::kCycleSlip).count, UINT32_MAX);
}

TEST_F(SingleLane, Tick_ControlUsesTheSlack_ShedsThePerceptionRowThatNoLongerFits) {
  run(1);  // slot 1 is full: 100 + 400 + 800 + 600 us
  make_long(kControl, 800.0);
  run(1);
  EXPECT_EQ(tasks.cycles.back().overran, 1U << kControl);
  EXPECT_EQ(tasks.cycles.back().shed, 1U << kPlanes) << "footholds still fit and matter more";
  EXPECT_FALSE(tasks.cycles.back().overrun);
  EXPECT_EQ(executive.row_statistics(kControl).overruns, 1U);
  EXPECT_EQ(executive.row_statistics(kPlanes).shed, 1U);
  EXPECT_EQ(health.count(ExecutiveEvent::kRowOverrun).count, 1U);
  EXPECT_EQ(health.count(ExecutiveEvent::kRowShed).count, 1U);
  EXPECT_EQ(health.count(ExecutiveEvent::kCycleOverrun).count, 0U);
  EXPECT_EQ(executive.shed_level(), 0U);
  run(1);
  EXPECT_EQ(tasks.cycles.back().shed, 0U);
}

TEST_F(SingleLane, Tick_WorkExactlyAtItsBounds_IsNeitherOverrunNorShed) {
  const auto next_odd_cycle = [this](std::size_t row, double duration_us) {  // 100 + 400 + 800 + 600 us
    run(1);
    make_long(row, duration_us);
    run(1);
    return tasks.cycles.back();
  };
  EXPECT_EQ(next_odd_cycle(kControl, 400.0).overran, 0U);
  EXPECT_EQ(next_odd_cycle(kControl, 400.001).overran, 1U << kControl);
  EXPECT_EQ(next_odd_cycle(kControl, 620.0).shed, 0U) << "with 800 + 600 us the cycle and the dispatch allowance";
  EXPECT_EQ(next_odd_cycle(kControl, 620.001).shed, 1U << kPlanes);
  EXPECT_FALSE(next_odd_cycle(kFootholds, 2000.0).overrun);
  EXPECT_TRUE(next_odd_cycle(kFootholds, 2000.001).overrun);
}

TEST_F(SingleLane, Tick_OverrunWhileRecovering_StartsTheRecoveryAnew) {
  make_long(kSense, 2500.0);
  run(1);
  run(Executive::kRecoveryCycles - 1);
  make_long(kSense, 2500.0);
  run(1);
  EXPECT_EQ(executive.shed_level(), 2U);
  run(Executive::kRecoveryCycles - 1);
  EXPECT_EQ(executive.shed_level(), 2U);
  run(1);
  EXPECT_EQ(executive.shed_level(), 1U);
  run(Executive::kRecoveryCycles - 1);
  EXPECT_EQ(executive.shed_level(), 1U);
  run(1);
  EXPECT_EQ(executive.shed_level(), 0U);
}

TEST_F(SingleLane, Tick_CycleOverrun_ShedsTheFirstOrderUntilAMajorCycleWentWell) {
  run(1);
  make_long(kFootholds, 2500.0);
  run(1);
  EXPECT_TRUE(tasks.cycles.back().overrun);
  EXPECT_EQ(executive.lane_statistics().overruns, 1U);
  EXPECT_EQ(health.count(ExecutiveEvent::kCycleOverrun).count, 1U);
  EXPECT_EQ(executive.shed_level(), 1U);
  const std::size_t planes_before = calls_of(kPlanes);
  const std::size_t control_before = calls_of(kControl);
  run(Executive::kRecoveryCycles);
  EXPECT_EQ(calls_of(kPlanes), planes_before);
  EXPECT_EQ(calls_of(kControl), control_before + Executive::kRecoveryCycles);
  EXPECT_EQ(executive.row_statistics(kPlanes).shed, Executive::kRecoveryCycles);
  EXPECT_EQ(executive.shed_level(), 0U);
  run(1);
  EXPECT_EQ(calls_of(kPlanes), planes_before + 1);
}

TEST_F(SingleLane, Tick_OverrunsEveryCycle_ShedsAllPerceptionAndNeverControl) {
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

TEST_F(SingleLane, ShedInNextCycle_Mask_ShedsThoseRowsOnceButNeverControl) {
  executive.shed_in_next_cycle(1U << kPlanes | 1U << kControl);
  run(1);
  EXPECT_EQ(tasks.cycles.back().shed, 1U << kPlanes);
  EXPECT_EQ(calls_of(kControl), 1U);
  run(1);
  EXPECT_EQ(tasks.cycles.back().shed, 0U);
}

TEST_F(SingleLane, RunRow_RecordedShedsReplayed_GivesTheSameCalls) {
  tasks.work = [this](const Call& call, WorkBudget& budget) {
    budget.spend(call.units + static_cast<std::int32_t>(call.cycle_ns % 7));
    if (call.row == kControl && call.cycle_ns / kCycle_ns % 5 == 0) clock.work_us(1200.0);
    return Progress::kBusy;
  };
  run(64);
  RecordingTasks replayed;
  replayed.work = [](const Call& call, WorkBudget& budget) {
    budget.spend(call.units + static_cast<std::int32_t>(call.cycle_ns % 7));
    return Progress::kBusy;
  };
  Counters replay_health;
  CyclicExecutive<RecordingTasks, kOneLane> replay(replayed, clock, replay_health);
  replay.start(kStart_ns);
  std::size_t shed = 0;
  for (const CycleReport& cycle : tasks.cycles) {
    shed += cycle.shed != 0 ? 1U : 0U;
    replay.shed_in_next_cycle(cycle.shed);
    ASSERT_EQ(replay.tick(cycle.due_ns), 1U);
  }
  EXPECT_GT(shed, 5U);
  ASSERT_EQ(replayed.calls.size(), tasks.calls.size());
  for (std::size_t i = 0; i < tasks.calls.size(); ++i) {
    ASSERT_EQ(replayed.calls[i].row, tasks.calls[i].row);
    ASSERT_EQ(replayed.calls[i].units, tasks.calls[i].units);
    ASSERT_EQ(replayed.calls[i].cycle_ns, tasks.calls[i].cycle_ns);
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
  clock.advance_count(UINT64_MAX - 1000);
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
  EXPECT_EQ(health.count(ExecutiveEvent::kRowDeferred).count, 6U);
}

TEST_F(SingleLane, RunRow_ShedWhileOverdrawn_PaysWithTheShedSlot) {
  constexpr std::int32_t kUnits = kOneLane[kPlanes].units_per_slot();
  tasks.work = [](const Call& call, WorkBudget& budget) {
    if (call.row == kPlanes) budget.spend(2 * kUnits);
    return Progress::kBusy;
  };
  run(1);
  executive.shed_in_next_cycle(1U << kPlanes);
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
    now_ns += (random >> 16) % 64 == 0 ? 9 * kCycle_ns : kCycle_ns;
    executive.tick(now_ns);
  }
  const LaneStatistics& lane = executive.lane_statistics();
  EXPECT_GT(lane.slips, 100U);
  const RowStatistics& planes = executive.row_statistics(kPlanes);  // in every slot
  EXPECT_EQ(planes.runs + planes.idle + planes.shed + planes.deferred, lane.cycles);
  const RowStatistics& control = executive.row_statistics(kControl);
  EXPECT_EQ(control.runs + control.idle, lane.cycles);
  EXPECT_EQ(lane.cycles + lane.slips, static_cast<std::uint64_t>((now_ns - kStart_ns) / kCycle_ns + 1));
  for (const std::uint64_t seen : {planes.shed, planes.deferred, planes.overruns, planes.idle, lane.overruns}) {
    EXPECT_GT(seen, 100U);
  }
}

TEST(CyclicExecutive, Start_ClockRateOutOfRange_RaisesTheFault) {
  for (const double rate : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    FakeClock clock(rate);
    RecordingTasks tasks;
    Counters health;
    CyclicExecutive<RecordingTasks, kOneLane> executive(tasks, clock, health);
    executive.start(0);
    EXPECT_EQ(health.count(ExecutiveEvent::kClockRate).count, 1U);
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
  Counters health;
  CyclicExecutive<RecordingTasks, kImportantFirst> executive(tasks, clock, health);
  tasks.work = [&clock](const Call& call, WorkBudget&) {
    clock.work_us(call.row == 0 ? 1000.0 : 590.0);
    return Progress::kDone;
  };
  executive.start(0);
  executive.tick(0);
  EXPECT_EQ(executive.last_cycle().ran, 0b011U);
  EXPECT_EQ(executive.last_cycle().shed, 0b100U);
}

// What the row before did not spend in this cycle, the next may; an overdraft of it is its own.
TEST(CyclicExecutive, RunRow_Leftover_IsSpentByTheNextRowOfTheCycle) {
  static constexpr ScheduleTable<3> kRows{{
      {.task = "surfaces", .budget_us = 700, .unit_cost_ns = 100, .shed_order = 3},
      {.task = "map", .budget_us = 100, .unit_cost_ns = 100, .shed_order = 2, .takes_leftover = true},
      {.task = "footholds", .budget_us = 200, .unit_cost_ns = 100, .shed_order = 1, .takes_leftover = true},
  }};
  static_assert(worst_cycle_instructions(kRows) == 10'000 * kInstructionsPerUnit);
  RecordingTasks tasks;
  FakeClock clock;
  Counters counters;
  CyclicExecutive<RecordingTasks, kRows> executive(tasks, clock, counters);
  executive.start(0);
  std::vector<std::int32_t> spends{3000, 500, 9000, 7500, 0, 0, 0, 0, 0};
  std::size_t next = 0;
  tasks.work = [&](const Call&, WorkBudget& budget) {
    budget.spend(spends[next++]);
    return Progress::kBusy;
  };
  for (int i = 0; i < 3; ++i) ASSERT_EQ(executive.tick(executive.next_due_ns()), 1U);
  std::vector<std::int32_t> units;
  for (const Call& call : tasks.calls) units.push_back(call.units);
  // First 4000 are left, then 4500 of 5000, and footholds overdraw their 6500 by 2500. Then surfaces overdraw by 500,
  // of which the next row sees nothing, and footholds pay 2500 of their 3000. What nobody spends is nobody's next
  // cycle.
  EXPECT_EQ(units, (std::vector<std::int32_t>{7000, 5000, 6500, 7000, 1000, 500, 6500, 7500, 9500}));
}

}  // namespace
}  // namespace polygmap
