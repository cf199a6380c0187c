// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/kinds/kinds.hpp"

#include <array>
#include <string>

#include "sim_stub/world/kinds/kind_worlds.hpp"

namespace polygmap::sim {
namespace {

constexpr auto kKinds = std::to_array<WorldKind>({
    {"up", "Straight stairs up, rises of 0.10 to 0.17 m, with posts and rails, walls, newels, boxes or nothing beside.",
     kinds::up},
    {"up-high", "Straight stairs up, rises of 0.18 to 0.22 m.", kinds::up_high},
    {"up-nosing", "Straight stairs up whose treads overhang their risers by 20 to 40 mm.", kinds::up_nosing},
    {"up-open", "Open stairs up: slabs of 30 to 50 mm that overhang each other by 20 to 40 mm.", kinds::up_open},
    {"down", "Straight stairs down, rises of 0.10 to 0.17 m, half of them with nosings of 10 to 40 mm.", kinds::down},
    {"down-high", "Straight stairs down, rises of 0.18 to 0.20 m.", kinds::down_high},
    {"down-open", "Open stairs down: slabs of 30 to 50 mm, nosings of 0 to 40 mm.", kinds::down_open},
    {"spiral-up", "A spiral up, to the left or right, 8 to 22.5 degrees a step, wide enough for the foot.",
     kinds::spiral_up},
    {"spiral-down", "The same down.", kinds::spiral_down},
    {"landing", "Two flights up with a landing between them, after a quarter turn or beside each other.",
     kinds::landing},
    {"curb-up", "A single step up of 0.04 to 0.22 m.", kinds::curb_up},
    {"curb-down", "A single step down of 0.04 to 0.22 m.", kinds::curb_down},
    {"ramp-up", "A ramp up of 1 to 12 degrees.", kinds::ramp_up},
    {"ramp-down", "A ramp down of 1 to 12 degrees.", kinds::ramp_down},
    {"stones", "Slabs with gaps of 20 to 120 mm, 30 mm higher or lower, tilted by up to 5 degrees.", kinds::stones},
    {"approach", "Stairs up 0.5 to 4 m away, in any direction, in a room with up to 6 pieces of furniture.",
     kinds::approach},
    {"trap",
     "A hole, a missing tread, a stool, the edge of a table, glass, a stairwell or stairs overhead, with or without a "
     "way round.",
     kinds::trap},
});

}  // namespace

std::span<const WorldKind> world_kinds() noexcept { return kKinds; }

WorldPlan draw_world(const WorldKind& kind, std::uint64_t seed) {
  Draw draw(seed, kind.name);
  WorldPlan plan = kind.draw(draw);
  plan.what = std::string(kind.name) + ", seed " + std::to_string(seed) + ": " + plan.what + ".";
  return plan;
}

}  // namespace polygmap::sim
