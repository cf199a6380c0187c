// SPDX-License-Identifier: Apache-2.0
// An executive for a lane that the table does not have.
// expect: the schedule has no row in this lane
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
constexpr ScheduleTable<1> kTable{{{.task = "control", .budget_us = 500}}};
#ifdef POSITIVE_CONTROL
template class CyclicExecutive<Tasks, kTable, 0>;
#else
template class CyclicExecutive<Tasks, kTable, 1>;
#endif
}  // namespace polygmap
