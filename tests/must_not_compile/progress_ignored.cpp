// SPDX-License-Identifier: Apache-2.0
// A step that is not done must be called again.
// expect: nodiscard
#include "algorithms/core/work.hpp"

polygmap::Progress step(polygmap::WorkBudget& budget) noexcept;
void run(polygmap::WorkBudget& budget) {
#ifdef POSITIVE_CONTROL
  while (step(budget) == polygmap::Progress::kBusy && !budget.exhausted()) {
  }
#else
  step(budget);
#endif
}
