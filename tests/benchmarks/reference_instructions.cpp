// SPDX-License-Identifier: Apache-2.0
// What the module is measured against, once on the same frames and ticks: toolchain/checks/instructions counts it
// beside the module's own stages. Prints the build that the counts are of and of every stage how many runs they are
// over.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "tests/benchmarks/build_name.hpp"
#include "tests/benchmarks/stair_scenes.hpp"
#include "tests/reference/base_filter/full_filters.hpp"
#include "tests/reference/paper_route/paper_route.hpp"
#include "tests/support/walk_rows.hpp"

namespace polygmap::bench {

// None is inlined: callgrind counts what is spent inside a function.

// The paper's filter of eqs (1)-(4), in four forms on the same rows.
struct PaperForms {
  BaseFilter axes;               // three filters of ten states
  reference::DenseFilter dense;  // as printed, fixed size
  reference::SequentialFilter sequential;
  reference::DynamicFilter dynamic;  // matrices on the heap
};
struct PaperTick {
  ContactRows rows;
  Vec3 accel_mps2 = Vec3::Zero();
};
constexpr double kTick_s = test::WalkRows::kTick_s;

void run_full(auto& form, const BaseFilter& axes, const PaperTick& tick) {
  const reference::FullStep step = reference::full_step(axes.base_process(kTick_s), tick.rows);
  form.predict(tick.accel_mps2, kTick_s, step);
  form.correct(step);
}
[[gnu::noinline]] void stage_base_axes(PaperForms& forms, const PaperTick& tick) {
  forms.axes.predict(tick.accel_mps2, kTick_s, tick.rows);
  forms.axes.correct(tick.rows);
}
[[gnu::noinline]] void stage_base_dense(PaperForms& forms, const PaperTick& tick) {
  run_full(forms.dense, forms.axes, tick);
}
[[gnu::noinline]] void stage_base_sequential(PaperForms& forms, const PaperTick& tick) {
  run_full(forms.sequential, forms.axes, tick);
}
[[gnu::noinline]] void stage_base_dynamic(PaperForms& forms, const PaperTick& tick) {
  run_full(forms.dynamic, forms.axes, tick);
}
[[gnu::noinline]] void stage_paper_route(PaperRoute& route, const StairScene& scene) {
  route.run(scene.depth.data(), scene.view.intrinsics, scene.view.camera_up);
}

}  // namespace polygmap::bench

int main() {
  using namespace polygmap;
  using namespace polygmap::bench;
  test::WalkSpec spec;
  spec.stand_s = 1.0;
  spec.steps = 1;
  test::WalkRows walk(spec);
  const auto forms = std::make_unique<PaperForms>();
  std::size_t ticks = 0;
  for (int i = 0; i < 1250; ++i) {
    walk.next();
    PaperTick tick{walk.rows, walk.accel_mps2};
    for (ContactRow& row : tick.rows) row.height_m2 = 1e-4;  // all 56 rows
    if (i == 0) {
      forms->axes = walk.axes;
      forms->dense.initialise(forms->axes);
      forms->sequential.initialise(forms->axes);
      forms->dynamic.initialise(forms->axes);
    }
    stage_base_axes(*forms, tick);
    stage_base_dense(*forms, tick);
    stage_base_sequential(*forms, tick);
    stage_base_dynamic(*forms, tick);
    ++ticks;
  }
  const auto off_m = [&](const auto& form) {
    return (form.state().template head<3>() - forms->axes.odom_p_base_m()).norm();
  };
  if (!(std::max({off_m(forms->dense), off_m(forms->sequential), off_m(forms->dynamic)}) < 1e-3)) {
    std::fprintf(stderr, "reference_instructions: the forms of the base filter disagree\n");
    return 1;
  }
  const auto route = std::make_unique<PaperRoute>(PaperRoute::Params{});
  const std::vector<StairScene> scenes = stair_scenes();
  for (const StairScene& scene : scenes) stage_paper_route(*route, scene);
  std::printf("build %s\nruns %zu\nruns_of paper_route %zu\n", build_name().c_str(), ticks, scenes.size());
  return 0;
}
