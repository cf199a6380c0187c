// SPDX-License-Identifier: Apache-2.0
// Work that cannot be resumed must not miss a slot.
// expect: only a resumable row may have a shed order
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<2> kTable{{
    {.task = "control", .budget_us = 500},
#ifdef POSITIVE_CONTROL
    {.task = "gait", .budget_us = 100},
#else
    {.task = "gait", .budget_us = 100, .shed_order = 1},
#endif
}};
template class CyclicExecutive<Tasks, kTable>;
}  // namespace polygmap
