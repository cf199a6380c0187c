// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/stair_world.hpp"

#include <cmath>

#include "sim_stub/camera/counter_noise.hpp"

namespace polygmap::sim {

double StairWorld::height_m(double x_m, double y_m, int* step) const noexcept {
  int top = -1;
  if (!steps.empty() && std::abs(y_m) <= half_width_m && x_m <= steps.back().back_x_m) {
    for (std::size_t k = 0; k < steps.size() && x_m >= steps[k].nosing_x_m; ++k) top = static_cast<int>(k);
  }
  if (step != nullptr) *step = top;
  return top < 0 ? 0.0 : steps[static_cast<std::size_t>(top)].height_m;
}

namespace {

// Posts in two rows, spaced evenly from half a spacing behind the first riser to the far end: set into the treads, not
// flush with a riser. One beside the staircase stands on the floor.
void add_balusters(const Balusters& posts, StairWorld& world) {
  if (!(posts.spacing_m > 0.0) || world.steps.empty()) return;
  const double half_m = 0.5 * posts.size_m, y_m = world.half_width_m - posts.inset_m - half_m;
  const double last_x_m = world.steps.back().back_x_m - half_m;
  for (double x_m = world.steps.front().riser_x_m + 0.5 * posts.spacing_m; x_m <= last_x_m; x_m += posts.spacing_m) {
    const double tread_m = world.height_m(x_m, 0.0), top_m = tread_m + posts.height_m;
    const double bottom_m = y_m - half_m >= world.half_width_m ? 0.0 : tread_m;
    for (const double side : {1.0, -1.0}) {
      if (!(side > 0.0 ? posts.left : posts.right)) continue;
      world.obstacles.push_back(
          {Vec3{x_m, side * y_m, 0.5 * (bottom_m + top_m)}, Vec3{posts.size_m, posts.size_m, top_m - bottom_m}});
    }
  }
}

}  // namespace

StairWorld make_stairs(const StairParams& params, std::uint64_t seed) {
  const CounterNoise noise(seed, Stream::kStairs);
  StairWorld world;
  world.half_width_m = 0.5 * params.width_m;
  double x_m = 0.0, z_m = 0.0;
  for (int k = 0; k < params.steps; ++k) {
    const auto index = 2 * static_cast<std::uint64_t>(k);
    const bool landing = k + 1 == params.steps;
    const double rise_m = params.rise_m + noise.uniform(index, -params.jitter_m, params.jitter_m);
    const double tread_m = params.tread_m + noise.uniform(index + 1, -params.jitter_m, params.jitter_m);
    z_m += rise_m;
    Step step;
    step.riser_x_m = x_m;
    step.nosing_x_m = x_m - params.nosing_m;
    x_m += landing ? params.landing_m : tread_m;
    step.back_x_m = x_m;
    step.height_m = z_m;
    world.steps.push_back(step);
  }
  world.obstacles = params.obstacles;
  add_balusters(params.balusters, world);
  return world;
}

}  // namespace polygmap::sim
