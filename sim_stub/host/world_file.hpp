// SPDX-License-Identifier: Apache-2.0
// A world of boxes with a start and a goal, from a TOML file: docs/reference/world.md.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "algorithms/core/messages/operator_command.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

struct WorldFile {
  StairWorld world;
  WorldPlace start;
  double start_height_m = 0.0;
};

// The world's goal, seen from its start.
[[nodiscard]] std::optional<Destination> destination_in(const WorldFile& file);

// Throws config::FileError: what is wrong, with its line.
[[nodiscard]] WorldFile parse_world(const std::string& path, std::string_view text);
[[nodiscard]] WorldFile read_world(const std::string& path);

}  // namespace polygmap::sim
