// SPDX-License-Identifier: Apache-2.0
// A work unit dearer than the slot would never be paid.
// expect: a resumable row is not paid a single unit per slot
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<2> kTable{{
    {.task = "control", .budget_us = 500},
#ifdef POSITIVE_CONTROL
    {.task = "planes", .budget_us = 100, .unit_cost_ns = 100'000},
#else
    {.task = "planes", .budget_us = 100, .unit_cost_ns = 100'001},
#endif
}};
template class CyclicExecutive<Tasks, kTable>;
}  // namespace polygmap
