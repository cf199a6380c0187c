// SPDX-License-Identifier: Apache-2.0
// A world in the staircase's stead: of a file, or drawn from the seed.
#pragma once

#include <string>

#include "sim_stub/host/climb/climb_options.hpp"

namespace CLI {
class App;
}

namespace polygmap::sim {

void declare_worlds(CLI::App& climb, ClimbOptions& options);

// Reads or draws the world that was asked for, if any; out_dir, seed and plant are known. Empty, or one sentence.
// Throws config::FileError.
[[nodiscard]] std::string take_world(const CLI::App& climb, ClimbOptions& options);

// A drawn one, into its file. Throws config::FileError.
void write_drawn_world(const ClimbOptions& options);

}  // namespace polygmap::sim
