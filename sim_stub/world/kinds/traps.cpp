// SPDX-License-Identifier: Apache-2.0
// What a robot must not fall for: it goes round it, or stops before it.
#include <array>

#include "sim_stub/world/kinds/flight.hpp"
#include "sim_stub/world/kinds/kind_worlds.hpp"

namespace polygmap::sim::kinds {
namespace {

Flight short_stairs(Draw& draw) {
  Flight flight;
  flight.steps = draw.whole(5, 7);
  flight.rise_m = draw.length_m(0.10, 0.17);
  flight.tread_m = draw.length_m(0.28, 0.33);
  flight.style.width_m = draw.length_m(0.9, 1.4);
  return flight;
}

// A platform of 3 x 3 m, its near edge at the origin, with a rectangular hole; what is left of it are four blocks.
struct Hole {
  double from_x_m, to_x_m, from_y_m, to_y_m;
};
void add_platform(WorldBuilder& world, double height_m, const Hole& hole) {
  constexpr double kLength_m = 3.4, kHalf_m = 1.5;
  const auto block = [&](const std::string& name, double from_x_m, double to_x_m, double from_y_m, double to_y_m) {
    if (to_x_m - from_x_m < 0.01 || to_y_m - from_y_m < 0.01) return;
    world.block(world.origin().ahead(from_x_m, 0.5 * (from_y_m + to_y_m), height_m), name, to_x_m - from_x_m,
                to_y_m - from_y_m);
  };
  block("near floor", 0.0, hole.from_x_m, -kHalf_m, kHalf_m);
  block("floor on the right", hole.from_x_m, hole.to_x_m, -kHalf_m, hole.from_y_m);
  block("floor on the left", hole.from_x_m, hole.to_x_m, hole.to_y_m, kHalf_m);
  block("far floor", hole.to_x_m, kLength_m, -kHalf_m, kHalf_m);
  world.way(world.origin().ahead(hole.to_x_m + 0.5), "far floor");
}

// A hole in the way, with a way round it; of a stairwell it is at one side of the platform.
WorldPlan hole_ahead(Draw& draw, bool is_stairwell) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const double height_m = draw.length_m(0.4, 1.0), edge_m = 0.9, length_m = draw.length_m(0.5, 1.2);
  const double left = draw.side(), inner_m = draw.length_m(0.25, 0.5);
  Hole hole{edge_m, edge_m + length_m, -inner_m, draw.length_m(0.25, 0.5)};
  if (is_stairwell) hole = {edge_m, edge_m + length_m, left > 0.0 ? -inner_m : -1.5, left > 0.0 ? 1.5 : inner_m};
  add_platform(world, height_m, hole);
  world.start(start_before(draw, world.origin().ahead(edge_m), 1.0), "near floor");
  world.goal(world.origin().ahead(hole.to_x_m + draw.length_m(0.4, 0.7)), "far floor");
  return world.take(std::string(is_stairwell ? "a stairwell" : "a hole") + " of " + metres(length_m) + " x " +
                    metres(hole.to_y_m - hole.from_y_m) + " m in a floor at " + metres(height_m) + " m");
}

WorldPlan hole(Draw& draw) { return hole_ahead(draw, false); }
WorldPlan stairwell(Draw& draw) { return hole_ahead(draw, true); }

WorldPlan missing_tread(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Flight flight = short_stairs(draw);
  flight.left_out = draw.whole(2, flight.steps - 1);
  flight.style.slab_m = draw.length_m(0.03, 0.05);
  const Frame foot = world.origin(), top = add_flight(world, draw, foot, flight);
  add_landing(world, top, "landing", 1.6, flight.style);
  world.start(start_before(draw, foot, flight.style.width_m), "floor");
  world.goal(goal_behind(draw, top), "landing");
  return world.take("a missing tread, step " + std::to_string(flight.left_out) + " of " + words_of(flight));
}

WorldPlan stool(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Vec3 size_m{draw.length_m(0.28, 0.4), draw.length_m(0.3, 0.5), draw.length_m(0.10, 0.20)};
  const Frame edge = world.origin();
  world.thing(edge.ahead(0.5 * size_m.x()), "stool", size_m);
  world.start(start_before(draw, edge, 0.9), "floor");
  if (draw.chance(0.5)) world.goal(edge.ahead(size_m.x() + draw.length_m(0.6, 1.0)), "floor");
  return world.take("a stool of " + metres(size_m.x()) + " x " + metres(size_m.y()) + " m, " + metres(size_m.z()) +
                    " m high");
}

WorldPlan table_edge(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const double height_m = draw.length_m(0.35, 0.9);
  const Frame edge = world.origin().ahead(0.0, 0.0, height_m);
  world.block(edge.ahead(-1.4), "table", 1.4, draw.length_m(1.0, 1.6), 0.05);
  world.start(start_before(draw, edge, 1.0), "table");
  return world.take("a table edge, " + metres(height_m) + " m high");
}

// A pane before the stairs, or treads of glass.
WorldPlan glass(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = short_stairs(draw);
  const Frame foot = world.origin();
  const bool is_pane = draw.chance(0.5);
  if (!is_pane) {
    for (int k = 1; k <= flight.steps; ++k) {
      world.block(flight.edge(foot, k), "glass step " + std::to_string(k), flight.tread_m, flight.style.width_m)
          .is_glass = true;
    }
    world.start(start_before(draw, foot, flight.style.width_m), "floor");
    return world.take("stairs of glass, " + words_of(flight));
  }
  const Frame top = add_flight(world, draw, foot, flight);
  add_landing(world, top, "landing", 1.6, flight.style);
  PlannedSolid& pane = world.thing(foot.ahead(-0.06), "pane", {0.02, flight.style.width_m + 0.6, 1.8});
  pane.is_glass = true;
  world.start(start_before(draw, foot.ahead(-0.07), flight.style.width_m), "floor");
  return world.take("a pane of glass before " + words_of(flight));
}

// Treads of the next turn, higher than the robot is, over stairs that it can climb.
WorldPlan spiral_overhead(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = short_stairs(draw);
  const Frame foot = world.origin(), top = add_flight(world, draw, foot, flight);
  add_landing(world, top, "landing", 1.6, flight.style);
  const double above_m = draw.length_m(2.0, 2.4), turned_deg = draw.angle_deg(-30.0, 30.0);
  for (int k = 1; k < flight.steps; ++k) {
    world
        .block(flight.edge(foot, k).ahead(0.0, 0.0, above_m, turned_deg), "overhead step " + std::to_string(k),
               flight.tread_m, 0.8, 0.05)
        .is_walkable = false;
  }
  world.start(start_before(draw, foot, flight.style.width_m), "floor");
  world.goal(goal_behind(draw, top), "landing");
  return world.take("a spiral overhead, " + metres(above_m) + " m above " + words_of(flight));
}

}  // namespace

WorldPlan trap(Draw& draw) {
  constexpr std::array kTraps{hole, missing_tread, stool, table_edge, glass, stairwell, spiral_overhead};
  return kTraps[static_cast<std::size_t>(draw.whole(0, kTraps.size() - 1))](draw);
}

}  // namespace polygmap::sim::kinds
