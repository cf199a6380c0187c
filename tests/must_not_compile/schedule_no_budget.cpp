// SPDX-License-Identifier: Apache-2.0
// A row that takes no time.
// expect: a schedule row has no budget
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<2> kTable{{
    {.task = "control", .budget_us = 500},
#ifdef POSITIVE_CONTROL
    {.task = "planes", .budget_us = 1},
#else
    {.task = "planes"},
#endif
}};
template class CyclicExecutive<Tasks, kTable>;
}  // namespace polygmap
