// SPDX-License-Identifier: Apache-2.0
// The schedule of the module: one row per task, in the order of the data flow.
#pragma once

#include "scheduler/schedule_table.hpp"

namespace polygmap {

enum Row : std::size_t { kSense, kEstimate, kGait, kCommand, kHealth, kIntake, kSurfaces, kMap, kFootholds, kRowCount };

// Control on lane 0, perception on lane 1; the simulation runs both in one lane, so all rows together fit one frame.
// Units: see the stage's step(). What they cost is stated here only, on one core of a shared AMD EPYC: 0.11-0.14 us
// (surfaces, means over generated stairs; 0.19 us on a cluttered desk; every piece's time over its units, the lower
// quartile of 25 times, on the desk of 81), 0.16-0.18 us (map) and 0.83-0.86 us (footholds: thread CPU time over the
// units spent, both taken around run_row() in `polygmap climb --steps 4 --seed 1`, three times). The table allows for
// more than twice these means, footholds for half as much again, which also covers what other programs on that machine
// take. It does not hold for each piece: on the desk a fourth row, in which four are cut into runs, takes 1.4-2.1 us of
// its one unit, eight columns' refit up to 1.3 us a unit, and the end of a meeting, where all boundaries are decided,
// 6 us of its one. A slot hands out hundreds. Shed first: what the next frame repeats anyway.
inline constexpr ScheduleTable<kRowCount> kSchedule{{
    {.task = "sense", .lane = 0, .budget_us = 40},
    {.task = "estimate", .lane = 0, .budget_us = 100},
    {.task = "gait", .lane = 0, .budget_us = 100},
    {.task = "command", .lane = 0, .budget_us = 20},
    {.task = "health", .lane = 0, .budget_us = 10},
    {.task = "intake", .lane = 1, .budget_us = 120},
    {.task = "surfaces", .lane = 1, .budget_us = 1100, .unit_cost_ns = 500, .shed_order = 3},
    {.task = "map", .lane = 1, .budget_us = 150, .unit_cost_ns = 400, .shed_order = 2},
    {.task = "footholds", .lane = 1, .budget_us = 350, .unit_cost_ns = 1300, .shed_order = 1},
}};
inline constexpr ScheduleTable<kRowCount> kOneLaneSchedule = in_one_lane(kSchedule);

static_assert(worst_minor_frame_us(kOneLaneSchedule) <= kMinorFrame_us);

}  // namespace polygmap
