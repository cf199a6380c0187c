// SPDX-License-Identifier: Apache-2.0
// Flights of stairs, straight or winding, and where the robot starts and is to go at their ends.
#pragma once

#include <string>

#include "sim_stub/world/kinds/builder.hpp"
#include "sim_stub/world/kinds/draw.hpp"

namespace polygmap::sim {

struct Flight {
  int steps = 8;  // the last one is the landing
  double rise_m = 0.15;
  double tread_m = 0.30;  // on the way of who walks in the middle
  TreadStyle style{};
  double turn_deg = 0.0;   // a step, to the left
  int left_out = 0;        // a step that is missing, from 1; 0: none
  bool is_uneven = false;  // each step a little higher or lower, turned and tilted, as stairs are built and settle

  [[nodiscard]] double height_m() const noexcept { return steps * rise_m; }
  // The edge of a step's front, above its riser, as high as it; between two steps so far on the way. In the frame of
  // the first riser's foot.
  [[nodiscard]] Frame edge(const Frame& foot, double step) const noexcept;
  // Of a flight that winds, of the way in its middle.
  [[nodiscard]] double radius_m() const noexcept;
};

// All but the landing: "step 1" to "step N-1", or what comes before the number. The landing's edge.
Frame add_flight(WorldBuilder& world, Draw& draw, const Frame& foot, const Flight& flight,
                 const std::string& named = "step ");
// From an edge that add_flight gave.
void add_landing(WorldBuilder& world, const Frame& edge, const std::string& name, double length_m,
                 const TreadStyle& style);

// How the robot stands before an edge that it looks at: 0.35 to 0.7 m from it, aside and turned a little.
[[nodiscard]] Frame start_before(Draw& draw, const Frame& edge, double width_m);
// 0.4 to 0.8 m behind it.
[[nodiscard]] Frame goal_behind(Draw& draw, const Frame& edge);

// "8 steps of 0.15 x 0.3 m, 1.1 m wide".
[[nodiscard]] std::string words_of(const Flight& flight);

}  // namespace polygmap::sim
