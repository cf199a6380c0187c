// SPDX-License-Identifier: Apache-2.0
// Every stage on every scene, once: what toolchain/checks/instructions counts. Prints the build that the counts are of
// and how many runs, here frames, they are over.
#include <cstdio>
#include <utility>

#include "tests/benchmarks/build_name.hpp"
#include "tests/benchmarks/perception_stages.hpp"

int main() {
  using namespace polygmap::bench;
  int frames = 0;
  for (StairScene& scene : stair_scenes()) {
    Workbench bench(std::move(scene));
    ++frames;
    if (const std::string_view complaint = bench.complaint(); !complaint.empty()) {
      std::fprintf(stderr, "perception_instructions: scene %d: %.*s\n", frames, static_cast<int>(complaint.size()),
                   complaint.data());
      return 1;
    }
    extract_in_stages(bench, [&bench](const Stage& stage) { stage.run(bench); });
    for (const Stage& stage : kOtherStages) stage.run(bench);
  }
  std::printf("build %s\nruns %d\n", build_name().c_str(), frames);
  return 0;
}
