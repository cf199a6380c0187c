// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/kinds/flight.hpp"

#include <algorithm>
#include <cmath>

namespace polygmap::sim {

double Flight::radius_m() const noexcept { return tread_m / (std::abs(turn_deg) * kPi / 180.0); }

Frame Flight::edge(const Frame& foot, double step) const noexcept {
  const double along = step - 1.0, height_m = std::floor(step) * rise_m;
  if (turn_deg == 0.0) return foot.ahead(along * tread_m, 0.0, height_m);
  const double turned_deg = along * turn_deg, turned_rad = std::abs(turned_deg) * kPi / 180.0;
  const double to_left = turn_deg > 0.0 ? 1.0 : -1.0;
  return foot.ahead(radius_m() * std::sin(turned_rad), to_left * radius_m() * (1.0 - std::cos(turned_rad)), height_m,
                    turned_deg);
}

Frame add_flight(WorldBuilder& world, Draw& draw, const Frame& foot, const Flight& flight, const std::string& named) {
  // What is turned otherwise than the next one reaches beneath it.
  constexpr double kBeneath_m = 0.02, kHigher_m = 0.003, kTurned_deg = 0.8, kSloped_deg = 0.7, kCanted_deg = 0.4;
  const double uneven = flight.is_uneven ? 1.0 : 0.0, turn_rad = std::abs(flight.turn_deg) * kPi / 180.0;
  double length_m = flight.tread_m + kBeneath_m * uneven;
  if (turn_rad > 0.0) {
    length_m = (flight.radius_m() + 0.5 * flight.style.width_m) * std::sin(turn_rad) + kBeneath_m;
  }
  for (int k = 1; k < flight.steps; ++k) {
    const double higher_m = uneven * draw.from(-kHigher_m, kHigher_m);
    const double turned_deg = uneven * draw.from(-kTurned_deg, kTurned_deg);
    const Tilt tilt{uneven * draw.from(-kCanted_deg, kCanted_deg), uneven * draw.from(-kSloped_deg, kSloped_deg)};
    if (k == flight.left_out) continue;
    const std::string name = named + std::to_string(k);
    world.tread(flight.edge(foot, k).ahead(0.0, 0.0, higher_m, turned_deg), name, length_m, flight.style, tilt);
    world.way(flight.edge(foot, k + 0.5).ahead(-flight.style.nosing_m), name);
  }
  return flight.edge(foot, flight.steps);
}

void add_landing(WorldBuilder& world, const Frame& edge, const std::string& name, double length_m,
                 const TreadStyle& style) {
  world.tread(edge, name, length_m, style);
  world.way(edge.ahead(0.5 * length_m), name);
}

Frame start_before(Draw& draw, const Frame& edge, double width_m) {
  const double aside_m = std::clamp(0.5 * width_m - 0.35, 0.0, 0.15);
  const double distance_m = draw.length_m(0.35, 0.7), lateral_m = draw.length_m(-aside_m, aside_m);
  return edge.ahead(-distance_m, lateral_m, 0.0, draw.angle_deg(-8.0, 8.0));
}

Frame goal_behind(Draw& draw, const Frame& edge) { return edge.ahead(draw.length_m(0.4, 0.8)); }

std::string words_of(const Flight& flight) {
  std::string words = std::to_string(flight.steps) + " steps of " + metres(flight.rise_m) + " x " +
                      metres(flight.tread_m) + " m, " + metres(flight.style.width_m) + " m wide";
  if (flight.style.nosing_m > 0.0) words += ", nosing " + metres(flight.style.nosing_m) + " m";
  if (flight.style.slab_m > 0.0) words += ", open, slabs of " + metres(flight.style.slab_m) + " m";
  return words + (flight.is_uneven ? ", uneven" : "");
}

}  // namespace polygmap::sim
