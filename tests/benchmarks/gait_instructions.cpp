// SPDX-License-Identifier: Apache-2.0
// The gait's ticks on one stair and the plan of one, once: what toolchain/checks/instructions counts. Prints the build
// that the counts are of, and of every stage how many runs they are over.
#include <algorithm>
#include <cstdio>
#include <memory>

#include "tests/benchmarks/build_name.hpp"
#include "tests/benchmarks/gait_stages.hpp"

int main() {
  using namespace polygmap;
  using namespace polygmap::bench;
  const auto stair = std::make_unique<GaitStair>();
  const auto bench = std::make_unique<GaitBench>(stair->start);
  for (const GaitTick& tick : stair->ticks) (tick.swings ? stage_gait_swing_tick : stage_gait_shift_tick)(*bench, tick);
  const auto plan = std::make_unique<StairPlan>();
  stage_gait_plan(*plan);
  stage_gait_proof(*plan);
  if (const std::string_view wrong = complaint(*bench, *plan); !wrong.empty()) {
    std::fprintf(stderr, "gait_instructions: %.*s\n", static_cast<int>(wrong.size()), wrong.data());
    return 1;
  }
  const auto swings =
      std::count_if(stair->ticks.begin(), stair->ticks.end(), [](const GaitTick& t) { return t.swings; });
  std::printf("build %s\nruns 1\nruns_of gait_swing_tick %td\nruns_of gait_shift_tick %td\n", build_name().c_str(),
              swings, static_cast<std::ptrdiff_t>(stair->ticks.size()) - swings);
  return 0;
}
