// SPDX-License-Identifier: Apache-2.0
// Stairs somewhere in a room with furniture.
#include <algorithm>
#include <cmath>
#include <vector>

#include "sim_stub/world/kinds/flight.hpp"
#include "sim_stub/world/kinds/kind_worlds.hpp"

namespace polygmap::sim::kinds {
namespace {

// What is kept clear of: as seen from above, in the stairs' frame.
struct Disc {
  Vec2 middle_m;
  double radius_m;
};

constexpr double kPassage_m = 0.9;  // between any two pieces, so that there always is a way

bool is_free(const Disc& piece, const std::vector<Disc>& taken, double half_width_m) {
  const bool at_the_stairs = piece.middle_m.x() + piece.radius_m > -kPassage_m &&
                             std::abs(piece.middle_m.y()) < half_width_m + piece.radius_m + 0.1;
  if (at_the_stairs) return false;
  return std::ranges::all_of(taken, [&](const Disc& other) {
    return (other.middle_m - piece.middle_m).norm() >= other.radius_m + piece.radius_m + kPassage_m;
  });
}

int add_furniture(WorldBuilder& world, Draw& draw, const Vec2& start_m, double half_width_m) {
  constexpr double kRobot_m = 0.3;
  constexpr int kTries = 20;
  std::vector<Disc> taken{{start_m, kRobot_m}};
  const int asked = draw.whole(0, 6);
  int placed = 0;
  for (int i = 0; i < asked * kTries && placed < asked; ++i) {
    const Vec3 size_m{draw.length_m(0.3, 1.0), draw.length_m(0.3, 0.7), draw.length_m(0.3, 1.2)};
    const Disc piece{{draw.length_m(-4.5, 0.5), draw.length_m(-3.0, 3.0)}, 0.5 * size_m.head<2>().norm()};
    const double turned_deg = draw.angle_deg(-90.0, 90.0);
    if (!is_free(piece, taken, half_width_m)) continue;
    world.thing(world.origin().ahead(piece.middle_m.x(), piece.middle_m.y(), 0.0, turned_deg),
                "furniture " + std::to_string(++placed), size_m);
    taken.push_back(piece);
  }
  return placed;
}

}  // namespace

WorldPlan approach(Draw& draw) {
  WorldBuilder world(draw.angle_deg(-180.0, 180.0));
  Flight flight;
  flight.steps = draw.whole(4, 6);
  flight.rise_m = draw.length_m(0.10, 0.17);
  flight.tread_m = draw.length_m(0.28, 0.33);
  flight.style.width_m = draw.length_m(1.0, 1.6);
  flight.is_uneven = draw.chance(0.5);
  const Frame foot = world.origin(), top = add_flight(world, draw, foot, flight);
  add_landing(world, top, "landing", 1.6, flight.style);

  constexpr double kNearest_m = 0.45;  // to the first riser's plane
  const double away_m = draw.length_m(0.5, 4.0);
  const double widest_rad = std::min(1.3, std::acos(kNearest_m / away_m));
  const double bearing_rad = draw.from(-widest_rad, widest_rad);
  const Vec2 start_m(-away_m * std::cos(bearing_rad), away_m * std::sin(bearing_rad));
  const double heading_deg = draw.angle_deg(-180.0, 180.0);
  const int pieces = add_furniture(world, draw, start_m, 0.5 * flight.style.width_m);
  world.start(foot.ahead(start_m.x(), start_m.y(), 0.0, heading_deg), "floor");
  world.goal(goal_behind(draw, top), "landing");
  return world.take(words_of(flight) + ", " + metres(away_m) + " m away, heading " + metres(heading_deg) +
                    " degrees off, " + std::to_string(pieces) + " pieces of furniture");
}

}  // namespace polygmap::sim::kinds
