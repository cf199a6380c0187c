// SPDX-License-Identifier: Apache-2.0
// Every stage of estimation on every tick, once: what toolchain/checks/instructions counts. Prints the build that the
// counts are of and how many runs, here ticks, they are over.
#include <cstdio>
#include <memory>

#include "tests/benchmarks/build_name.hpp"
#include "tests/benchmarks/estimation_stages.hpp"

int main() {
  using namespace polygmap::bench;
  const auto walk = std::make_unique<EstimationWalk>();
  const auto bench = std::make_unique<EstimationBench>(walk->start);
  for (const EstimationStage& stage : kEstimationStages) {
    for (const EstimationTick& tick : walk->ticks) stage.run(*bench, tick);
  }
  if (const std::string_view wrong = complaint(*bench, *walk); !wrong.empty()) {
    std::fprintf(stderr, "estimation_instructions: %.*s\n", static_cast<int>(wrong.size()), wrong.data());
    return 1;
  }
  std::printf("build %s\nruns %zu\n", build_name().c_str(), walk->ticks.size());
  return 0;
}
