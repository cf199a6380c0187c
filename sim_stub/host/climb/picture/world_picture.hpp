// SPDX-License-Identifier: Apache-2.0
// The true staircase or world in the picture of a climb.
#pragma once

#include <string>

#include "sim_stub/host/climb/picture/svg_canvas.hpp"
#include "sim_stub/host/world_file.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim::svg {

// A staircase's profile, or the floor alone; x_m: what the view has.
void add_stairs_from_the_side(std::string& out, const View& view, const StairWorld& world, const Range& x_m,
                              double floor_bottom_m);
void add_stairs_from_above(std::string& out, const View& view, const StairWorld& world);
void add_step_numbers(std::string& out, const View& view, const StairWorld& world, bool from_the_side);
// Of a world file: each as its outline, the nearest last; what is not to be stood on shows what is behind it.
void add_solids(std::string& out, const View& view, const StairWorld& world);
// Where the robot starts and is to go.
void add_places(std::string& out, const View& view, const WorldFile& file);

// Turns a world so that its way goes to the right: from the start to the goal, else where the robot looks at first.
[[nodiscard]] Mat3 view_turn(const WorldFile& file);

}  // namespace polygmap::sim::svg
