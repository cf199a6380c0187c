// SPDX-License-Identifier: Apache-2.0
// A schedule to test the executive with, and tasks that record how they are called.
#pragma once

#include <functional>
#include <vector>

#include "scheduler/cyclic_executive.hpp"
#include "scheduler/schedule_table.hpp"

namespace polygmap::test {

// An example of the table that the firmware owns: control in every slot, then resumable work in two lanes.
enum Row : std::size_t { kSense, kControl, kHealth, kPlanes, kFootholds };
inline constexpr ScheduleTable<5> kTable{{
    {.task = "sense", .lane = 0, .slots = kEverySlot, .budget_us = 100},
    {.task = "control", .lane = 0, .slots = kEverySlot, .budget_us = 400},
    {.task = "health", .lane = 0, .slots = slots_from(15, 16), .budget_us = 100},
    {.task = "planes", .lane = 1, .slots = kEverySlot, .budget_us = 800, .unit_cost_ns = 20, .shed_order = 1},
    {.task = "footholds", .lane = 1, .slots = slots_from(1, 2), .budget_us = 600, .unit_cost_ns = 150, .shed_order = 2},
}};
inline constexpr ScheduleTable<5> kOneLane = in_one_lane(kTable);

using Counters = EventCounters<ExecutiveEvent>;

struct Call {
  std::size_t row;
  std::int64_t cycle_ns;
  std::int32_t units;
};

// Records every call; `work` decides what a call does.
struct RecordingTasks {
  std::vector<Call> calls;
  std::vector<CycleReport> cycles;
  std::function<Progress(const Call&, WorkBudget&)> work = [](const Call&, WorkBudget&) { return Progress::kDone; };

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    calls.push_back({row, cycle_ns, budget.left()});
    return work(calls.back(), budget);
  }
  void cycle_done(std::size_t, const CycleReport& report) noexcept { cycles.push_back(report); }
};

}  // namespace polygmap::test
