// SPDX-License-Identifier: Apache-2.0
// Kinds of worlds that a seed is drawn of: `polygmap climb --kind`.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "sim_stub/world/kinds/draw.hpp"
#include "sim_stub/world/kinds/world_plan.hpp"

namespace polygmap::sim {

struct WorldKind {
  std::string_view name;
  std::string_view what;  // one sentence
  WorldPlan (*draw)(Draw&);
};
[[nodiscard]] std::span<const WorldKind> world_kinds() noexcept;

// The same kind and seed, the same world.
[[nodiscard]] WorldPlan draw_world(const WorldKind& kind, std::uint64_t seed);

}  // namespace polygmap::sim
