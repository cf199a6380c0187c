// SPDX-License-Identifier: Apache-2.0
// The gait's ticks on one stair and the plan of one, once: what toolchain/checks/instructions counts. Prints the build
// that the counts are of, and of every stage how many runs they are over.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "tests/benchmarks/build_name.hpp"
#include "tests/benchmarks/gait_stages.hpp"

int main() {
  using namespace polygmap;
  using namespace polygmap::bench;
  const auto stair = std::make_unique<GaitStair>();
  const auto bench = std::make_unique<GaitBench>(stair->start);
  for (const GaitTick& tick : stair->ticks) (tick.swings ? stage_gait_swing_tick : stage_gait_shift_tick)(*bench, tick);
  const auto walk = std::make_unique<WalkAtAWall>();
  const auto walker = std::make_unique<GaitBench>(walk->start);
  for (const GaitTick& tick : walk->ticks) (tick.swings ? swing_on : stage_gait_walk_tick)(*walker, tick);
  const auto plan = std::make_unique<StairPlan>();
  stage_gait_plan(*plan);
  stage_gait_proof(*plan);
  if (const std::string_view wrong = complaint(*bench, *plan); !wrong.empty()) {
    std::fprintf(stderr, "gait_instructions: %.*s\n", static_cast<int>(wrong.size()), wrong.data());
    return 1;
  }
  const auto swings_of = [](const std::vector<GaitTick>& ticks) {
    return std::count_if(ticks.begin(), ticks.end(), [](const GaitTick& tick) { return tick.swings; });
  };
  const auto swings = swings_of(stair->ticks), walk_swings = swings_of(walk->ticks);
  std::printf(
      "build %s\nruns 1\nruns_of gait_swing_tick %td\nruns_of gait_shift_tick %td\nruns_of gait_walk_tick %td\n",
      build_name().c_str(), swings, static_cast<std::ptrdiff_t>(stair->ticks.size()) - swings,
      static_cast<std::ptrdiff_t>(walk->ticks.size()) - walk_swings);
  return 0;
}
