// SPDX-License-Identifier: Apache-2.0
// The schedule of the module: one row per task, in the order of the data flow.
#pragma once

#include <algorithm>
#include <array>

#include "firmware/pipeline.hpp"
#include "scheduler/cyclic_executive.hpp"
#include "scheduler/schedule_table.hpp"

namespace polygmap {

struct TaskFunction {
  Progress (*run)(Pipeline& pipeline, std::int64_t cycle_ns, WorkBudget& budget) noexcept;
  std::uint8_t lane;  // whose objects it works on
  bool resumable;     // it takes a budget
};
struct Task {
  ScheduleRow row;
  TaskFunction function;
};

template <Progress (ControlLane::*Function)(std::int64_t) noexcept>
inline constexpr TaskFunction kControl{
    [](Pipeline& p, std::int64_t cycle_ns, WorkBudget&) noexcept { return (p.control().*Function)(cycle_ns); },
    kControlLane, false};
template <Progress (PerceptionLane::*Function)(std::int64_t) noexcept>
inline constexpr TaskFunction kPerception{
    [](Pipeline& p, std::int64_t cycle_ns, WorkBudget&) noexcept { return (p.perception().*Function)(cycle_ns); },
    kPerceptionLane, false};
template <Progress (PerceptionLane::*Function)(std::int64_t, WorkBudget&) noexcept>
inline constexpr TaskFunction kPerceptionWork{[](Pipeline& p, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
                                                return (p.perception().*Function)(cycle_ns, budget);
                                              },
                                              kPerceptionLane, true};

// Control on lane 0, perception on lane 1; the simulation runs both in one lane, so all rows together fit one cycle.
// Units: see the stage's step(). What they cost is stated here only, on one core of a shared AMD EPYC: 0.11-0.14 us
// (surfaces, means over generated stairs; 0.19 us on a cluttered desk; every piece's time over its units, the lower
// quartile of 25 times, on the desk of 81), 0.16-0.18 us (map) and 0.83-0.86 us (footholds: thread CPU time over the
// units spent, both taken around run_row() in `polygmap climb --steps 4 --seed 1`, three times). The table allows for
// more than twice these means, footholds for half as much again, which also covers what other programs on that machine
// take. It does not hold for each piece: on the desk a fourth row, in which four are cut into segments, takes 1.4-2.1
// us of its one unit, eight columns' refit up to 1.3 us a unit, and the end of the pass in which neighbours meet, where
// all boundaries are decided, 6 us of its one. A slot hands out hundreds. Shed first: what the next frame repeats
// anyway.
// clang-format off
inline constexpr std::array kTasks = std::to_array<Task>({
    {{.task = "sense", .lane = 0, .budget_us = 40}, kControl<&ControlLane::sense>},
    {{.task = "estimate", .lane = 0, .budget_us = 100}, kControl<&ControlLane::estimate>},
    {{.task = "gait", .lane = 0, .budget_us = 100}, kControl<&ControlLane::gait>},
    {{.task = "command", .lane = 0, .budget_us = 20}, kControl<&ControlLane::command>},
    {{.task = "health", .lane = 0, .budget_us = 10}, kControl<&ControlLane::health>},
    {{.task = "intake", .lane = 1, .budget_us = 120}, kPerception<&PerceptionLane::intake>},
    {{.task = "surfaces", .lane = 1, .budget_us = 1100, .unit_cost_ns = 500, .shed_order = 3}, kPerceptionWork<&PerceptionLane::surfaces>},
    {{.task = "map", .lane = 1, .budget_us = 150, .unit_cost_ns = 400, .shed_order = 2}, kPerceptionWork<&PerceptionLane::map>},
    {{.task = "footholds", .lane = 1, .budget_us = 350, .unit_cost_ns = 1300, .shed_order = 1}, kPerceptionWork<&PerceptionLane::footholds>},
});
// clang-format on

inline constexpr ScheduleTable<kTasks.size()> kSchedule = [] {
  ScheduleTable<kTasks.size()> rows;
  std::ranges::transform(kTasks, rows.begin(), &Task::row);
  return rows;
}();
inline constexpr ScheduleTable<kTasks.size()> kOneLaneSchedule = in_one_lane(kSchedule);

static_assert(worst_cycle_us(kOneLaneSchedule) <= kCycle_us);
static_assert(lane_count(kSchedule) == kLaneCount);
static_assert(std::ranges::all_of(kTasks,
                                  [](const Task& task) {
                                    return task.row.lane == task.function.lane &&
                                           task.row.resumable() == task.function.resumable;
                                  }),
              "a task runs in its objects' lane, and takes a budget where its row has a unit cost");

// The executives of the module as the robot runs it, and of all rows in one lane.
template <std::size_t LaneNumber>
using LaneExecutive = CyclicExecutive<Pipeline, kSchedule, LaneNumber, Health>;
template <typename Tasks = Pipeline>
requires WatchesCycles<Tasks>  // it tells the pipeline, which hands over nothing otherwise
using OneLaneExecutive = CyclicExecutive<Tasks, kOneLaneSchedule, 0, Health>;

}  // namespace polygmap
