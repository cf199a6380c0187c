// SPDX-License-Identifier: Apache-2.0
// Straight flights both ways, what stands beside them, and single steps.
#include <array>

#include "sim_stub/world/kinds/flight.hpp"
#include "sim_stub/world/kinds/kind_worlds.hpp"

namespace polygmap::sim::kinds {
namespace {

Flight straight(Draw& draw, double least_rise_m, double most_rise_m) {
  Flight flight;
  flight.steps = draw.whole(6, 12);
  flight.rise_m = draw.length_m(least_rise_m, most_rise_m);
  flight.tread_m = draw.length_m(0.28, 0.35);
  flight.style.width_m = draw.length_m(0.8, 1.4);
  flight.is_uneven = draw.chance(0.5);
  return flight;
}

constexpr double kLanding_m = 1.6;

void go_up(WorldBuilder& world, Draw& draw, const Flight& flight) {
  const Frame foot = world.origin(), top = add_flight(world, draw, foot, flight);
  add_landing(world, top, "landing", kLanding_m, flight.style);
  world.start(start_before(draw, foot, flight.style.width_m), "floor");
  world.goal(goal_behind(draw, top), "landing");
}

void go_down(WorldBuilder& world, Draw& draw, const Flight& flight) {
  const Frame foot = world.origin(), top = add_flight(world, draw, foot, flight);
  add_landing(world, top, "landing", kLanding_m, flight.style);
  const Frame lip = top.ahead(-flight.style.nosing_m, 0.0, 0.0, 180.0);
  world.start(start_before(draw, lip, flight.style.width_m), "landing");
  world.goal(goal_behind(draw, foot.ahead(0.0, 0.0, 0.0, 180.0)), "floor");
}

// Along both sides, on the treads or beside the stairs, as far apart as the treads or half of it.
std::string posts(WorldBuilder& world, Draw& draw, const Flight& flight) {
  constexpr double kRail_m = 0.9;
  const double side_m = draw.length_m(0.03, 0.05);
  const bool beside = draw.chance(0.5);
  const double y_m = 0.5 * (flight.style.width_m + (beside ? 1.2 : -1.2) * side_m) + (beside ? 0.01 : -0.02);
  const int per_tread = draw.whole(1, 2);
  for (const double left : {1.0, -1.0}) {
    const std::string side = left > 0.0 ? "left" : "right";
    const auto foot_of = [&](double step) {
      return flight.edge(world.origin(), step).ahead(-flight.style.nosing_m, left * y_m);
    };
    for (int i = 0; i < per_tread * (flight.steps - 1); ++i) {
      const double step = 1.0 + (i + 0.5) / per_tread;
      const Frame foot = foot_of(step);
      const double height_m = kRail_m + (beside ? foot.p_m.z() : 0.0);
      world.thing(beside ? foot.ahead(0.0, 0.0, -foot.p_m.z()) : foot, side + " post " + std::to_string(i + 1),
                  {side_m, side_m, height_m});
    }
    const Vec3 rail_m(0.0, 0.0, kRail_m + 0.5 * side_m);
    world.bar(foot_of(1.5).p_m + rail_m, foot_of(flight.steps - 0.5).p_m + rail_m, side + " rail", side_m);
  }
  return beside ? "posts and rails beside the treads" : "posts and rails on the treads";
}

std::string walls(WorldBuilder& world, Draw& draw, const Flight& flight) {
  const double length_m = flight.steps * flight.tread_m + kLanding_m, height_m = flight.height_m() + 1.0;
  const bool both = draw.chance(0.5);
  const double only = draw.side(), apart_m = draw.length_m(0.0, 0.1);
  for (const double left : {1.0, -1.0}) {
    if (!both && left != only) continue;
    const double y_m = 0.5 * flight.style.width_m + apart_m + 0.05;
    world.thing(world.origin().ahead(0.5 * length_m - 0.2, left * y_m), left > 0.0 ? "left wall" : "right wall",
                {length_m, 0.1, height_m});
  }
  return both ? "walls on both sides" : "a wall on one side";
}

// Thick posts at both ends of the flight, on its first tread and on its landing.
std::string newels(WorldBuilder& world, Draw& draw, const Flight& flight) {
  const double side_m = draw.length_m(0.08, 0.14);
  for (const double left : {1.0, -1.0}) {
    const double y_m = left * (0.5 * flight.style.width_m - 0.5 * side_m - 0.01);
    for (const int step : {1, flight.steps}) {
      const Frame foot = flight.edge(world.origin(), step).ahead(0.5 * side_m + 0.02, y_m);
      world.thing(foot, std::string(left > 0.0 ? "left" : "right") + " newel " + std::to_string(step),
                  {side_m, side_m, 1.1});
    }
  }
  return "newels";
}

std::string boxes(WorldBuilder& world, Draw& draw, const Flight& flight) {
  const int count = draw.whole(2, 4);
  for (int i = 0; i < count; ++i) {
    const double side_m = draw.length_m(0.2, 0.6), height_m = draw.length_m(0.2, 1.2);
    const double along_m = draw.length_m(-0.2, flight.steps * flight.tread_m);
    const double y_m = draw.side() * (0.5 * flight.style.width_m + 0.75 * side_m + 0.02);
    world.thing(world.origin().ahead(along_m, y_m, 0.0, draw.angle_deg(-20.0, 20.0)), "box " + std::to_string(i + 1),
                {side_m, side_m, height_m});
  }
  return "boxes beside it";
}

}  // namespace

WorldPlan up(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = straight(draw, 0.10, 0.17);
  go_up(world, draw, flight);
  std::string beside = "nothing beside it";
  switch (draw.whole(0, 5)) {
    case 0:
    case 1:
      beside = posts(world, draw, flight);
      break;
    case 2:
      beside = walls(world, draw, flight);
      break;
    case 3:
      beside = newels(world, draw, flight);
      break;
    case 4:
      beside = boxes(world, draw, flight);
      break;
    default:
      break;
  }
  return world.take(words_of(flight) + ", " + beside);
}

WorldPlan up_high(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = straight(draw, 0.18, 0.22);
  go_up(world, draw, flight);
  return world.take(words_of(flight));
}

WorldPlan up_nosing(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Flight flight = straight(draw, 0.10, 0.17);
  flight.style.nosing_m = draw.length_m(0.02, 0.04);
  go_up(world, draw, flight);
  return world.take(words_of(flight));
}

WorldPlan up_open(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Flight flight = straight(draw, 0.10, 0.17);
  flight.style.slab_m = draw.length_m(0.03, 0.05);
  flight.style.nosing_m = draw.length_m(0.02, 0.04);
  go_up(world, draw, flight);
  return world.take(words_of(flight));
}

WorldPlan down(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Flight flight = straight(draw, 0.10, 0.17);
  if (draw.chance(0.5)) flight.style.nosing_m = draw.length_m(0.01, 0.04);
  go_down(world, draw, flight);
  return world.take("down " + words_of(flight));
}

WorldPlan down_high(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = straight(draw, 0.18, 0.20);
  go_down(world, draw, flight);
  return world.take("down " + words_of(flight));
}

WorldPlan down_open(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Flight flight = straight(draw, 0.10, 0.17);
  flight.style.slab_m = draw.length_m(0.03, 0.05);
  flight.style.nosing_m = draw.length_m(0.0, 0.04);
  go_down(world, draw, flight);
  return world.take("down " + words_of(flight));
}

namespace {

Flight single_step(Draw& draw) {
  Flight flight;
  flight.steps = 1;
  flight.rise_m = draw.length_m(0.04, 0.22);
  flight.style.width_m = draw.length_m(1.0, 2.0);
  return flight;
}

}  // namespace

WorldPlan curb_up(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = single_step(draw);
  go_up(world, draw, flight);
  return world.take("a step up of " + metres(flight.rise_m) + " m");
}

WorldPlan curb_down(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  const Flight flight = single_step(draw);
  go_down(world, draw, flight);
  return world.take("a step down of " + metres(flight.rise_m) + " m");
}

}  // namespace polygmap::sim::kinds
