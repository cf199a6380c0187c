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
// Instructions are AArch64's, of user code: rows that are not resumable are measured over a climb, in worst pictures,
// and with the codec (sense, command). A resumable row's follow from its units, kInstructionsPerUnit each:
// toolchain/checks/pieces counts the pieces that its program reaches, not the mount's, nor the beginnings of map and
// search. A unit is given 120 ns, at one instruction a nanosecond and a fifth for the piece that overdraws;
// microseconds of sense and command have the kernel's share in them, 12 writes and 17 reads. What perception leaves of
// a cycle its followers take. Shed first: what the next frame repeats anyway.
// clang-format off
inline constexpr std::array kTasks = std::to_array<Task>({
    {{.task = "sense", .lane = 0, .budget_us = 120, .instructions = 11'000}, kControl<&ControlLane::sense>},
    {{.task = "estimate", .lane = 0, .budget_us = 150, .instructions = 72'000}, kControl<&ControlLane::estimate>},
    {{.task = "gait", .lane = 0, .budget_us = 120, .instructions = 65'000}, kControl<&ControlLane::gait>},
    {{.task = "command", .lane = 0, .budget_us = 200, .newest_only = true, .instructions = 7'000}, kControl<&ControlLane::command>},
    {{.task = "health", .lane = 0, .budget_us = 10, .instructions = 1'300}, kControl<&ControlLane::health>},
    {{.task = "intake", .lane = 1, .budget_us = 40, .instructions = 14'000}, kPerception<&PerceptionLane::intake>},
    {{.task = "surfaces", .lane = 1, .budget_us = 840, .unit_cost_ns = 120, .shed_order = 3}, kPerceptionWork<&PerceptionLane::surfaces>},
    {{.task = "map", .lane = 1, .budget_us = 96, .unit_cost_ns = 120, .shed_order = 2, .takes_leftover = true}, kPerceptionWork<&PerceptionLane::map>},
    {{.task = "footholds", .lane = 1, .budget_us = 180, .unit_cost_ns = 120, .shed_order = 1, .takes_leftover = true}, kPerceptionWork<&PerceptionLane::footholds>},
});
// clang-format on

inline constexpr ScheduleTable<kTasks.size()> kSchedule = [] {
  ScheduleTable<kTasks.size()> rows;
  std::ranges::transform(kTasks, rows.begin(), &Task::row);
  return rows;
}();
inline constexpr ScheduleTable<kTasks.size()> kOneLaneSchedule = in_one_lane(kSchedule);

static_assert(worst_cycle_us(kOneLaneSchedule) <= kCycle_us);
// User code of a cycle, in one lane; what the last piece of work overdraws is to fit, too.
inline constexpr std::int64_t kCycleInstructions = 1'200'000, kOverdraftInstructions = 60'000;
static_assert(worst_cycle_instructions(kOneLaneSchedule) + kOverdraftInstructions <= kCycleInstructions);
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
