// SPDX-License-Identifier: Apache-2.0
// A number is not a budget: microseconds and units must not be mixed up.
// expect: (could not convert|no viable conversion|no known conversion|conversion from .* non-scalar)
#include "algorithms/core/work.hpp"

void step(polygmap::WorkBudget budget);
#ifdef POSITIVE_CONTROL
void run() { step(polygmap::WorkBudget(300)); }
#else
void run() { step(300); }
#endif
