// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/stair_world.hpp"

#include <algorithm>
#include <cmath>

#include "sim_stub/camera/counter_noise.hpp"

namespace polygmap::sim {

double Step::top_m(double x_m, double y_m) const noexcept {
  const Vec3 normal = true_T_step.R.col(2);
  const Vec3& p_m = true_T_step.p_m;
  return (height_m - normal.x() * (x_m - p_m.x()) - normal.y() * (y_m - p_m.y())) / normal.z() + p_m.z();
}

double StairWorld::height_m(double x_m, double y_m, int* step) const noexcept {
  const auto place_m = [&](const Step& s) {  // along the step's axes
    return s.true_T_step.inverse() * Vec3{x_m, y_m, s.top_m(x_m, y_m)};
  };
  int top = -1;
  if (!steps.empty() && place_m(steps.back()).x() <= steps.back().back_x_m) {
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const Vec3 p_m = place_m(steps[k]);
      if (p_m.x() < steps[k].nosing_x_m) break;
      if (std::abs(p_m.y()) <= half_width_m) top = static_cast<int>(k);
    }
  }
  if (step != nullptr) *step = top;
  return top < 0 ? 0.0 : steps[static_cast<std::size_t>(top)].top_m(x_m, y_m);
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

StairWorld make_stairs(const StairParams& params, std::uint64_t seed, const StairErrors& errors) {
  const CounterNoise noise(seed, Stream::kStairs), built(seed, Stream::kStairErrors);
  StairWorld world;
  world.half_width_m = 0.5 * params.width_m;
  double x_m = 0.0, z_m = 0.0;
  for (int k = 0; k < params.steps; ++k) {
    const auto index = 2 * static_cast<std::uint64_t>(k);
    const bool landing = k + 1 == params.steps;
    const auto within = [&built, k](std::uint64_t item, double half) {
      constexpr std::uint64_t kItems = 4;
      return built.uniform(kItems * static_cast<std::uint64_t>(k) + item, -half, half);
    };
    const double rise_m =
        params.rise_m + noise.uniform(index, -params.jitter_m, params.jitter_m) + within(0, errors.rise_error_m);
    const double tread_m = params.tread_m + noise.uniform(index + 1, -params.jitter_m, params.jitter_m);
    z_m += rise_m;
    Step step;
    step.riser_x_m = x_m;
    step.nosing_x_m = x_m - params.nosing_m;
    x_m += landing ? params.landing_m : tread_m;
    step.back_x_m = x_m;
    step.height_m = z_m;
    step.half_width_m = world.half_width_m;
    step.worn_m = errors.worn_nosing_m;
    // About y, a positive angle lowers what is ahead.
    const double slope_rad = within(1, errors.tread_slope_rad) - errors.tread_fall_rad;
    const Mat3 turn = rotation_zyx(within(3, errors.tread_yaw_rad), slope_rad, within(2, errors.tread_cant_rad));
    const Vec3 nosing_m{step.nosing_x_m, 0.0, step.height_m};
    step.true_T_step = {turn, nosing_m - turn * nosing_m};
    world.steps.push_back(step);
  }
  const bool turned = std::ranges::any_of(world.steps, &Step::turned);
  constexpr double kBeneath_m = 0.1;
  for (Step& step : world.steps) {
    if (turned && &step != &world.steps.back()) step.beneath_m = kBeneath_m;
  }
  world.obstacles = params.obstacles;
  add_balusters(params.balusters, world);
  return world;
}

}  // namespace polygmap::sim
