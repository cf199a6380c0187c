// SPDX-License-Identifier: Apache-2.0
// Stairs that turn: spirals of wedges, and two flights with a landing between them.
#include <algorithm>
#include <array>
#include <cmath>

#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/world/kinds/flight.hpp"
#include "sim_stub/world/kinds/kind_worlds.hpp"

namespace polygmap::sim::kinds {
namespace {

// Of the body's way, so that a foot on the bisector of a wedge has 6 mm to both its edges, the other one beside it
// further out; and 0.1 m more.
double least_radius_m(double turn_deg) {
  constexpr double kMargin_m = 0.006, kMore_m = 0.1;
  const SoleRectangle& sole = nominal_robot().sole.collision;
  const double half_rad = 0.5 * turn_deg * kPi / 180.0, half_length_m = 0.5 * (sole.toe_x_m - sole.heel_x_m);
  return nominal_robot().stance.half_width_m + sole.half_width_m +
         (half_length_m + kMargin_m / std::cos(half_rad)) / std::tan(half_rad) + kMore_m;
}

Flight winding(Draw& draw) {
  constexpr std::array kTurns_deg{8.0, 10.0, 12.0, 15.0, 18.0, 22.5};
  constexpr double kMostTurned_deg = 180.0;  // it does not come back over itself
  const double turn_deg = kTurns_deg[static_cast<std::size_t>(draw.whole(0, kTurns_deg.size() - 1))];
  Flight flight;
  flight.steps = std::min(draw.whole(6, 12), static_cast<int>(kMostTurned_deg / turn_deg));
  flight.rise_m = draw.length_m(0.10, 0.17);
  flight.turn_deg = draw.side() * turn_deg;
  const double radius_m = least_radius_m(turn_deg) + draw.length_m(0.0, 0.2);
  flight.tread_m = radius_m * turn_deg * kPi / 180.0;
  flight.style.width_m = draw.length_m(0.8, 1.2);
  if (draw.chance(0.5)) flight.style.slab_m = draw.length_m(0.03, 0.05);
  flight.is_uneven = draw.chance(0.5);
  return flight;
}

Frame add_spiral(WorldBuilder& world, Draw& draw, const Flight& flight) {
  const Frame foot = world.origin(), top = add_flight(world, draw, foot, flight);
  add_landing(world, top, "landing", 1.6, flight.style);
  const double inside_m = flight.radius_m() - 0.5 * flight.style.width_m;
  constexpr double kColumn_m = 0.15;
  if (inside_m > kColumn_m) {
    const double to_left = flight.turn_deg > 0.0 ? 1.0 : -1.0;
    world.thing(foot.ahead(0.0, to_left * flight.radius_m()), "column",
                {kColumn_m, kColumn_m, flight.height_m() + 1.0});
  }
  return top;
}

std::string words_of_spiral(const Flight& flight) {
  return words_of(flight) + ", " + metres(std::abs(flight.turn_deg)) + " degrees to the " +
         (flight.turn_deg > 0.0 ? "left" : "right") + " each, " + metres(flight.radius_m()) + " m from the column";
}

}  // namespace

WorldPlan spiral_up(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = winding(draw);
  const Frame top = add_spiral(world, draw, flight);
  world.start(start_before(draw, world.origin(), flight.style.width_m), "floor");
  world.goal(goal_behind(draw, top), "landing");
  return world.take("a spiral up, " + words_of_spiral(flight));
}

WorldPlan spiral_down(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = winding(draw);
  const Frame top = add_spiral(world, draw, flight);
  world.start(start_before(draw, top.ahead(0.0, 0.0, 0.0, 180.0), flight.style.width_m), "landing");
  world.goal(goal_behind(draw, world.origin().ahead(0.0, 0.0, 0.0, 180.0)), "floor");
  return world.take("a spiral down, going up " + words_of_spiral(flight));
}

WorldPlan landing(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Flight flight;
  flight.steps = draw.whole(3, 5);
  flight.rise_m = draw.length_m(0.10, 0.17);
  flight.tread_m = draw.length_m(0.28, 0.33);
  const double width_m = flight.style.width_m = draw.length_m(1.0, 1.6);
  flight.is_uneven = draw.chance(0.5);
  const double left = draw.side();
  const bool turns_back = draw.chance(0.5);
  const Frame foot = world.origin(), lower_top = add_flight(world, draw, foot, flight, "lower step ");
  const double eye_m = turns_back ? draw.length_m(0.05, 0.3) : 0.0;  // between the two flights
  const double across_m = turns_back ? 2.0 * width_m + eye_m : width_m;
  const double shift_m = turns_back ? 0.5 * (width_m + eye_m) : 0.0;
  world.block(lower_top.ahead(0.0, left * shift_m), "half landing", width_m, across_m);
  Flight upper = flight;
  upper.steps = draw.whole(3, 5);
  const Frame next = turns_back ? lower_top.ahead(0.0, left * 2.0 * shift_m, 0.0, 180.0)
                                : lower_top.ahead(0.5 * width_m, left * 0.5 * width_m, 0.0, left * 90.0);
  const Frame top = add_flight(world, draw, next, upper, "upper step ");
  add_landing(world, top, "top", 1.4, flight.style);
  world.way(lower_top.ahead(0.5 * width_m), "half landing");
  world.start(start_before(draw, foot, width_m), "floor");
  world.goal(goal_behind(draw, top), "top");
  return world.take(words_of(flight) + ", a landing, " + (turns_back ? "back" : "a quarter turn") + " to the " +
                    (left > 0.0 ? "left" : "right") + ", " + std::to_string(upper.steps) + " steps");
}

}  // namespace polygmap::sim::kinds
