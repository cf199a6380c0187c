// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/world_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>
#include <vector>

#include "firmware/config/file_error.hpp"
#include "sim_stub/host/cli/command_words.hpp"
#include "sim_stub/host/output_file.hpp"
#include "sim_stub/world/kinds/kinds.hpp"

namespace polygmap::sim {
namespace {

WorldPlan plan_of(const ClimbOptions& options) {
  return draw_world(*std::ranges::find(world_kinds(), options.world_kind, &WorldKind::name), options.seed);
}

// The robot could not be sent to a goal beyond that. Throws config::FileError.
void check_goal(const ClimbOptions& options) {
  const std::optional<Destination> goal = destination_in(*options.world);
  if (!goal || goal->is_valid()) return;
  throw config::FileError(config::FileName{"world", options.world_file}.text() + ": its goal is " +
                          number(goal->ahead_m) + " m ahead and " + number(goal->left_m) +
                          " m to the left of where the robot starts, and go_to takes " +
                          number(Destination::kFarthest_m) + " m at most, each way.");
}

}  // namespace

void declare_worlds(CLI::App& climb, ClimbOptions& options) {
  CLI::Option* file =
      climb
          .add_option("--world", options.world_file,
                      "A world of boxes with a start and a goal in the staircase's stead, see docs/reference/world.md")
          ->type_name("WORLD.toml");
  climb.add_flag("--back", options.comes_back,
                 "At the world's goal it is sent back to where it started, which is its goal from then on");
  std::vector<std::string> names;
  std::string listed = "Kinds of worlds:";
  for (const WorldKind& kind : world_kinds()) {
    names.emplace_back(kind.name);
    listed += "\n  " + names.back() + std::string(14 - kind.name.size(), ' ') + std::string(kind.what);
  }
  CLI::Option& kind = *climb
                           .add_option("--kind", options.world_kind,
                                       "A world of this kind in the staircase's stead, drawn by the seed; written to "
                                       "OUT/world.toml, which --world reads")
                           ->excludes(file);
  keep_among(kind, names);
  kind.type_name("KIND");
  climb.footer(listed + "\n\n" + climb.get_footer());
}

std::string take_world(const CLI::App& climb, ClimbOptions& options) {
  const std::string option = options.world_kind.empty() ? "--world" : "--kind";
  if (options.world_kind.empty() && options.world_file.empty()) {
    return options.comes_back ? "--back needs a world with a goal: --world or --kind." : "";
  }
  for (const char* name : {"--steps", "--rise", "--tread", "--width", "--nosing", "--landing", "--jitter",
                           "--balusters", "--obstacle", "--render-missing-step"}) {
    if (climb.count(name) > 0) return std::string(name) + " is of a staircase, and " + option + " has none.";
  }
  if (options.plant != PlantKind::kMujoco) {
    return option + " needs --plant mujoco: the kinematic plant knows stairs alone.";
  }
  if (options.world_kind.empty()) {
    options.world = read_world(options.world_file);
    check_goal(options);
    if (options.comes_back && !options.world->world.goal)
      return "--back needs a goal, and " + options.world_file + " has none.";
    return {};
  }
  const WorldPlan plan = plan_of(options);
  options.world_file = options.out_dir + "/world.toml";
  options.world_drawn = plan.what;
  options.world = parse_world(options.world_file, to_toml(plan));
  check_goal(options);
  if (options.comes_back && !options.world->world.goal)
    return "--back needs a goal, and this " + options.world_kind + " has none.";
  return {};
}

void write_drawn_world(const ClimbOptions& options) {
  if (!options.world_kind.empty()) write_output(options.world_file, to_toml(plan_of(options)));
}

}  // namespace polygmap::sim
