// SPDX-License-Identifier: Apache-2.0
// One function for each kind of worlds: what it is like is in the table of kinds.cpp.
#pragma once

#include "sim_stub/world/kinds/draw.hpp"
#include "sim_stub/world/kinds/world_plan.hpp"

namespace polygmap::sim::kinds {

[[nodiscard]] WorldPlan up(Draw& draw);
[[nodiscard]] WorldPlan up_high(Draw& draw);
[[nodiscard]] WorldPlan up_nosing(Draw& draw);
[[nodiscard]] WorldPlan up_open(Draw& draw);
[[nodiscard]] WorldPlan down(Draw& draw);
[[nodiscard]] WorldPlan down_high(Draw& draw);
[[nodiscard]] WorldPlan down_open(Draw& draw);
[[nodiscard]] WorldPlan curb_up(Draw& draw);
[[nodiscard]] WorldPlan curb_down(Draw& draw);

[[nodiscard]] WorldPlan spiral_up(Draw& draw);
[[nodiscard]] WorldPlan spiral_down(Draw& draw);
[[nodiscard]] WorldPlan landing(Draw& draw);

[[nodiscard]] WorldPlan ramp_up(Draw& draw);
[[nodiscard]] WorldPlan ramp_down(Draw& draw);
[[nodiscard]] WorldPlan stones(Draw& draw);

[[nodiscard]] WorldPlan approach(Draw& draw);
[[nodiscard]] WorldPlan trap(Draw& draw);

}  // namespace polygmap::sim::kinds
