// SPDX-License-Identifier: Apache-2.0
// Ramps, and slabs with gaps between them.
#include <cmath>

#include "sim_stub/world/kinds/flight.hpp"
#include "sim_stub/world/kinds/kind_worlds.hpp"

namespace polygmap::sim::kinds {
namespace {

constexpr double kRadPerDeg = kPi / 180.0;
constexpr double kEnd_m = 1.6;  // of what is level at the ends

struct Ramp {
  double angle_deg, run_m, width_m;
  [[nodiscard]] double height_m() const { return run_m * std::tan(angle_deg * kRadPerDeg); }
};

// The edge of what is level above it.
Frame add_ramp(WorldBuilder& world, Draw& draw, Ramp& ramp) {
  ramp = {0.1 * std::round(10.0 * draw.from(1.0, 12.0)), draw.length_m(1.2, 3.0), draw.length_m(1.0, 1.6)};
  constexpr double kThickness_m = 0.2;
  const double angle_rad = ramp.angle_deg * kRadPerDeg, length_m = ramp.run_m / std::cos(angle_rad);
  const Vec3 beneath_m = 0.5 * kThickness_m * Vec3(std::sin(angle_rad), 0.0, -std::cos(angle_rad));
  const Frame foot = world.origin(), top = foot.ahead(ramp.run_m, 0.0, ramp.height_m());
  world.box(foot, "ramp", Vec3(0.5 * ramp.run_m, 0.0, 0.5 * ramp.height_m()) + beneath_m,
            {length_m, ramp.width_m, kThickness_m}, 0.0, -ramp.angle_deg);
  world.block(top, "landing", kEnd_m, ramp.width_m);
  world.way(foot.ahead(0.5 * ramp.run_m), "ramp");
  world.way(top.ahead(0.5 * kEnd_m), "landing");
  return top;
}

std::string words_of(const Ramp& ramp) { return metres(ramp.angle_deg) + " degrees over " + metres(ramp.run_m) + " m"; }

}  // namespace

WorldPlan ramp_up(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Ramp ramp{};
  const Frame top = add_ramp(world, draw, ramp);
  world.start(start_before(draw, world.origin(), ramp.width_m), "floor");
  world.goal(goal_behind(draw, top), "landing");
  return world.take("a ramp up of " + words_of(ramp));
}

WorldPlan ramp_down(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Ramp ramp{};
  const Frame top = add_ramp(world, draw, ramp);
  world.start(start_before(draw, top.ahead(0.0, 0.0, 0.0, 180.0), ramp.width_m), "landing");
  world.goal(goal_behind(draw, world.origin().ahead(0.0, 0.0, 0.0, 180.0)), "floor");
  return world.take("a ramp down of " + words_of(ramp));
}

WorldPlan stones(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  constexpr double kUneven_m = 0.03, kTilt_deg = 5.0, kThickness_m = 0.12;
  const int rows = draw.whole(4, 7);
  const bool paired = draw.chance(0.5);  // a stone for each foot
  const double height_m = draw.length_m(0.15, 0.30), bank_m = 1.4;
  world.block(world.origin().ahead(-kEnd_m, 0.0, height_m), "near bank", kEnd_m, bank_m);
  double x_m = 0.0;
  for (int row = 1; row <= rows; ++row) {
    x_m += draw.length_m(0.02, 0.12);
    const double length_m = draw.length_m(0.34, 0.5), across_m = paired ? draw.length_m(0.02, 0.06) : 0.0;
    for (int i = 0; i < (paired ? 2 : 1); ++i) {
      const double left = paired ? (i == 0 ? 1.0 : -1.0) : 0.0;
      const double width_m = paired ? draw.length_m(0.34, 0.45) : draw.length_m(0.6, 1.0);
      const std::string name = (left > 0.0   ? "left stone "
                                : left < 0.0 ? "right stone "
                                             : "stone ") +
                               std::to_string(row);
      const Tilt tilt{draw.from(-kTilt_deg, kTilt_deg), draw.from(-kTilt_deg, kTilt_deg)};
      const Frame edge =
          world.origin().ahead(x_m, left * 0.5 * (width_m + across_m), height_m + draw.length_m(-kUneven_m, kUneven_m));
      world.block(edge, name, length_m, width_m, kThickness_m, tilt);
      const Frame middle = world.origin().ahead(x_m + 0.5 * length_m);
      if (left >= 0.0) world.way_of_foot(middle, Foot::kLeft, name);
      if (left <= 0.0) world.way_of_foot(middle, Foot::kRight, name);
    }
    x_m += length_m;
  }
  const Frame far = world.origin().ahead(x_m + draw.length_m(0.02, 0.12), 0.0, height_m);
  world.block(far, "far bank", kEnd_m, bank_m);
  world.way(far.ahead(0.5 * kEnd_m), "far bank");
  world.start(start_before(draw, world.origin(), 1.0), "near bank");
  world.goal(goal_behind(draw, far), "far bank");
  return world.take(std::to_string(rows) + (paired ? " pairs of stones" : " slabs") + " at " + metres(height_m) + " m");
}

}  // namespace polygmap::sim::kinds
