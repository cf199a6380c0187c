// SPDX-License-Identifier: Apache-2.0
// A row that never runs.
// expect: a schedule row runs in no slot
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<2> kTable{{
    {.task = "control", .budget_us = 500},
#ifdef POSITIVE_CONTROL
    {.task = "planes", .slots = 1, .budget_us = 100},
#else
    {.task = "planes", .slots = 0, .budget_us = 100},
#endif
}};
template class CyclicExecutive<Tasks, kTable>;
}  // namespace polygmap
