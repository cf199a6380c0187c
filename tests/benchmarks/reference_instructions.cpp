// SPDX-License-Identifier: Apache-2.0
// What the module is measured against, once on the same frames and ticks: toolchain/checks/instructions counts it
// beside the module's own stages. Prints the build that the counts are of and of every stage how many runs they are
// over.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "tests/benchmarks/build_name.hpp"
#include "tests/benchmarks/estimation_stages.hpp"
#include "tests/benchmarks/stair_scenes.hpp"
#include "tests/reference/base_filter/full_filters.hpp"
#include "tests/reference/paper_route/paper_route.hpp"
#include "tests/support/walk_rows.hpp"

namespace polygmap::bench {

// None is inlined: callgrind counts what is spent inside a function.

// The full forms of the base filter, on the rows that the three axis filters have.
struct FullForms {
  reference::DenseFilter dense;  // as printed, fixed size
  reference::SequentialFilter sequential;
  reference::DynamicFilter dynamic;  // matrices on the heap
};

void run_full(auto& form, const BaseFilter& axes, const EstimationTick& tick) {
  const reference::FullStep step = reference::full_step(axes.base_process(test::WalkRows::kTick_s), tick.rows);
  form.predict(tick.accel_mps2, test::WalkRows::kTick_s, step);
  form.correct(step);
}
[[gnu::noinline]] void stage_base_dense(FullForms& forms, const BaseFilter& axes, const EstimationTick& tick) {
  run_full(forms.dense, axes, tick);
}
[[gnu::noinline]] void stage_base_sequential(FullForms& forms, const BaseFilter& axes, const EstimationTick& tick) {
  run_full(forms.sequential, axes, tick);
}
[[gnu::noinline]] void stage_base_dynamic(FullForms& forms, const BaseFilter& axes, const EstimationTick& tick) {
  run_full(forms.dynamic, axes, tick);
}
[[gnu::noinline]] void stage_paper_route(PaperRoute& route, const StairScene& scene) {
  route.run(scene.depth.data(), scene.view.intrinsics, scene.view.camera_up);
}

}  // namespace polygmap::bench

int main() {
  using namespace polygmap;
  using namespace polygmap::bench;
  const auto walk = std::make_unique<EstimationWalk>();
  const auto bench = std::make_unique<EstimationBench>(walk->start);
  const auto forms = std::make_unique<FullForms>();
  forms->dense.initialise(bench->axes);
  forms->sequential.initialise(bench->axes);
  forms->dynamic.initialise(bench->axes);
  for (const EstimationTick& tick : walk->ticks) {
    bench->axes.predict(tick.accel_mps2, test::WalkRows::kTick_s, tick.rows);
    bench->axes.correct(tick.rows);
    stage_base_dense(*forms, bench->axes, tick);
    stage_base_sequential(*forms, bench->axes, tick);
    stage_base_dynamic(*forms, bench->axes, tick);
  }
  const auto off_m = [&](const auto& form) {
    return (form.state().template head<3>() - bench->axes.odom_p_base_m()).norm();
  };
  // Not the same filter to the last digit: the full forms began without the axis filters' correlations.
  if (!(std::max({off_m(forms->dense), off_m(forms->sequential), off_m(forms->dynamic)}) < 1e-3)) {
    std::fprintf(stderr, "reference_instructions: the forms of the base filter disagree\n");
    return 1;
  }
  const auto route = std::make_unique<PaperRoute>(PaperRoute::Params{});
  const std::vector<StairScene> scenes = stair_scenes();
  for (const StairScene& scene : scenes) stage_paper_route(*route, scene);
  std::printf("build %s\nruns %zu\nruns_of paper_route %zu\n", build_name().c_str(), walk->ticks.size(), scenes.size());
  return 0;
}
