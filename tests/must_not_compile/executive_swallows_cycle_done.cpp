// SPDX-License-Identifier: Apache-2.0
// Whoever stands before the module's tasks and hands on the rows alone would keep the lanes from seeing each other.
// expect: Tasks needs: void cycle_done
#include "tests/must_not_compile/schedule.hpp"

namespace polygmap {
class Wrapper {
 public:
  explicit Wrapper(Tasks& tasks) noexcept : tasks_(tasks) {}
  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    return tasks_.run_row(row, cycle_ns, budget);
  }
#ifdef POSITIVE_CONTROL
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept { tasks_.cycle_done(lane, report); }
#endif

 private:
  Tasks& tasks_;
};
constexpr ScheduleTable<1> kTable{{{.task = "control", .budget_us = 500}}};
template class CyclicExecutive<Wrapper, kTable>;
}  // namespace polygmap
