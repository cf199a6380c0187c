// SPDX-License-Identifier: Apache-2.0
// A world of boxes with a start and a goal, from a TOML file: docs/reference/world.md.
#pragma once

#include <string>
#include <string_view>

#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

struct WorldFile {
  StairWorld world;
  WorldPlace start;
  double start_height_m = 0.0;
};

// Throws config::FileError: what is wrong, with its line.
[[nodiscard]] WorldFile parse_world(const std::string& path, std::string_view text);
[[nodiscard]] WorldFile read_world(const std::string& path);

}  // namespace polygmap::sim
