// SPDX-License-Identifier: Apache-2.0
// Time of every stage of perception, of the whole frame, the map, the foothold search and the streaming floor, on the
// same frames. Time is the mean over scenes; the counters say how it spreads over them.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/benchmarks/cpu_seconds.hpp"
#include "tests/benchmarks/perception_stages.hpp"

namespace polygmap::bench {
namespace {

constexpr int kPasses = 20;  // over all scenes

double seconds_in(const Stage& stage, Workbench& bench) {
  const double start = cpu_seconds();
  stage.run(bench);
  return cpu_seconds() - start;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Runs a stage once per iteration, each time on the next scene. Of a scene's passes the median counts.
void report(benchmark::State& state, std::vector<Workbench>& benches, const auto& seconds_of) {
  std::vector<std::vector<double>> passes_us(benches.size());
  std::size_t at = 0;
  for (auto _ : state) {
    const double seconds = seconds_of(benches[at]);
    state.SetIterationTime(seconds);
    passes_us[at].push_back(1e6 * seconds);
    at = (at + 1) % benches.size();
  }
  std::vector<double> scenes_us;
  for (const std::vector<double>& scene : passes_us) {
    if (!scene.empty()) scenes_us.push_back(median(scene));
  }
  const double middle_us = median(scenes_us), most_us = *std::max_element(scenes_us.begin(), scenes_us.end());
  state.counters["median_us"] = middle_us;
  state.counters["max_us"] = most_us;
  state.counters["max/median"] = most_us / middle_us;
}

void time_extractor_stage(benchmark::State& state, std::vector<Workbench>& benches, const Stage& wanted) {
  report(state, benches, [&wanted](Workbench& bench) {
    double seconds = 0.0;
    extract_in_stages(bench, [&](const Stage& stage) {
      const double spent = seconds_in(stage, bench);
      if (stage.run == wanted.run) seconds += spent;
    });
    return seconds;
  });
}

void time_stage(benchmark::State& state, std::vector<Workbench>& benches, const Stage& stage) {
  report(state, benches, [&stage](Workbench& bench) { return seconds_in(stage, bench); });
}

int run(int argc, char** argv) {
  std::vector<Workbench> benches;
  for (StairScene& scene : stair_scenes()) {
    if (const std::string_view complaint = benches.emplace_back(std::move(scene)).complaint(); !complaint.empty()) {
      std::fprintf(stderr, "perception_benchmark: scene %zu: %.*s\n", benches.size(),
                   static_cast<int>(complaint.size()), complaint.data());
      return 1;
    }
  }
  const auto add = [&](const Stage& stage, auto* function) {
    benchmark::RegisterBenchmark(std::string(stage.name).c_str(), function, std::ref(benches), std::cref(stage))
        ->Iterations(static_cast<benchmark::IterationCount>(kPasses * benches.size()))
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  };
  for (const Stage& stage : kOtherStages) add(stage, time_stage);
  for (const Stage& stage : kExtractorStages) add(stage, time_extractor_stage);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace polygmap::bench

int main(int argc, char** argv) { return polygmap::bench::run(argc, argv); }
