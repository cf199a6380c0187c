// SPDX-License-Identifier: Apache-2.0
// The plan as the C interface has it, of a module that whoever reads it may hold otherwise than as an instance.
#pragma once

#include <cstdint>

#include "firmware/control_lane.hpp"
#include "firmware/link/abi.hpp"
#include "firmware/link/instance_clock.hpp"

namespace polygmap::link {

struct PlanSource {
  const ControlLane& control;
  const MapSnapshot& map;  // as far as control sees it
  std::int64_t cycle_ns;   // the module's time of the cycle that the plan is as of
};

// All but the polygons, and the struct's size.
void read_steps(const PlanSource& source, const InstanceClock& clock, polygmap_plan& to) noexcept;
// The polygons, and how many there are.
void read_polygons(const PlanSource& source, const InstanceClock& clock, polygmap_plan& to) noexcept;

}  // namespace polygmap::link
