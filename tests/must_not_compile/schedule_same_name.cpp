// SPDX-License-Identifier: Apache-2.0
// Two rows of one name cannot be told apart in a report.
// expect: every schedule row needs a name of its own
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<2> kTable{{
    {.task = "control", .budget_us = 500},
#ifdef POSITIVE_CONTROL
    {.task = "planes", .budget_us = 100},
#else
    {.task = "control", .budget_us = 100},
#endif
}};
template class CyclicExecutive<Tasks, kTable>;
}  // namespace polygmap
