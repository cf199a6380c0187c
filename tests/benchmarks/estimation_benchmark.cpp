// SPDX-License-Identifier: Apache-2.0
// Time per tick of estimation's stages, on the same ticks.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <memory>
#include <string>

#include "tests/benchmarks/cpu_seconds.hpp"
#include "tests/benchmarks/estimation_stages.hpp"

namespace polygmap::bench {
namespace {

constexpr int kPasses =
    10;  // through all ticks, each from the start: the filters' own covariances evolve as on a climb

int run(int argc, char** argv) {
  const auto walk = std::make_unique<EstimationWalk>();
  const auto bench = std::make_unique<EstimationBench>(walk->start);
  for (const EstimationStage& stage : kEstimationStages) {
    benchmark::RegisterBenchmark(std::string(stage.name).c_str(),
                                 [&](benchmark::State& state) {
                                   for (auto _ : state) {
                                     *bench = walk->start;
                                     const double start = cpu_seconds();
                                     for (const EstimationTick& tick : walk->ticks) stage.run(*bench, tick);
                                     const double spent = cpu_seconds() - start;
                                     state.SetIterationTime(spent / static_cast<double>(walk->ticks.size()));
                                   }
                                 })
        ->Iterations(kPasses)
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace polygmap::bench

int main(int argc, char** argv) { return polygmap::bench::run(argc, argv); }
