// SPDX-License-Identifier: Apache-2.0
// The budgets of one slot add up to 2001 us: the build fails, not the robot.
// expect: the rows of a lane do not fit one cycle
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<2> kTable{{
    {.task = "control", .budget_us = 500},
#ifdef POSITIVE_CONTROL
    {.task = "planes", .slots = slots_from(3, 8), .budget_us = 1500, .unit_cost_ns = 20},
#else
    {.task = "planes", .slots = slots_from(3, 8), .budget_us = 1501, .unit_cost_ns = 20},
#endif
}};
template class CyclicExecutive<Tasks, kTable>;
}  // namespace polygmap
