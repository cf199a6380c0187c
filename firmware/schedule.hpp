// SPDX-License-Identifier: Apache-2.0
// The schedule of the module: one row per task, in the order of the data flow.
#pragma once

#include "scheduler/schedule_table.hpp"

namespace polygmap {

enum Row : std::size_t { kSense, kEstimate, kGait, kCommand, kHealth, kIntake, kSurfaces, kMap, kFootholds, kRowCount };

// Control on lane 0, perception on lane 1; the simulation runs both in one lane, so all rows together fit one frame.
// Units: see the stage's step(); their costs are those of a 2.4 GHz x86 core (0.66 us, 0.2 us and 2.1 us measured, the
// `wall` figures of summary.json over the units) with half as much again. Shed first: what the next frame repeats
// anyway.
inline constexpr ScheduleTable<kRowCount> kSchedule{{
    {.task = "sense", .lane = 0, .budget_us = 40},
    {.task = "estimate", .lane = 0, .budget_us = 100},
    {.task = "gait", .lane = 0, .budget_us = 100},
    {.task = "command", .lane = 0, .budget_us = 20},
    {.task = "health", .lane = 0, .budget_us = 10},
    {.task = "intake", .lane = 1, .budget_us = 120},
    {.task = "surfaces", .lane = 1, .budget_us = 1100, .unit_cost_ns = 1000, .shed_order = 3},
    {.task = "map", .lane = 1, .budget_us = 150, .unit_cost_ns = 400, .shed_order = 2},
    {.task = "footholds", .lane = 1, .budget_us = 350, .unit_cost_ns = 3000, .shed_order = 1},
}};
inline constexpr ScheduleTable<kRowCount> kOneLaneSchedule = in_one_lane(kSchedule);

static_assert(worst_minor_frame_us(kOneLaneSchedule) <= kMinorFrame_us);

}  // namespace polygmap
