// SPDX-License-Identifier: Apache-2.0
// A task that may throw would end the program in the middle of a swing.
// expect: Tasks needs: Progress run_row
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
struct OtherTasks {
#ifdef POSITIVE_CONTROL
  Progress run_row(std::size_t, std::int64_t, WorkBudget&) noexcept { return Progress::kDone; }
#else
  Progress run_row(std::size_t, std::int64_t, WorkBudget&) { return Progress::kDone; }
#endif
  void cycle_done(std::size_t, const CycleReport&) noexcept {}
};
constexpr ScheduleTable<1> kTable{{{.task = "control", .budget_us = 500}}};
template class CyclicExecutive<OtherTasks, kTable>;
}  // namespace polygmap
