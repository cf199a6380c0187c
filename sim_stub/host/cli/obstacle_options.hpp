// SPDX-License-Identifier: Apache-2.0
// What stands on or beside the simulated staircase: posts and boxes.
#pragma once

#include "sim_stub/world/stair_world.hpp"

namespace CLI {
class App;
}

namespace polygmap::sim {

void declare_obstacles(CLI::App& climb, StairParams& stairs);

}  // namespace polygmap::sim
