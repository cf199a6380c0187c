// SPDX-License-Identifier: Apache-2.0
// A lane without rows would be a core without work.
// expect: schedule rows stand in the order of their lanes
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<2> kTable{{
    {.task = "control", .budget_us = 500},
#ifdef POSITIVE_CONTROL
    {.task = "planes", .lane = 1, .budget_us = 100},
#else
    {.task = "planes", .lane = 2, .budget_us = 100},
#endif
}};
template class CyclicExecutive<Tasks, kTable>;
}  // namespace polygmap
