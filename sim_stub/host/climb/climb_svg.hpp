// SPDX-License-Identifier: Apache-2.0
// A picture of one climb: what was there, what the module saw, where it meant to step and where it stepped.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "sim_stub/host/climb/climb_summary.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

// All in the true world; the module's world is laid on it once, at tick 0.
struct ClimbDrawing {
  struct Polygon {
    SurfaceKind kind = SurfaceKind::kOther;
    std::vector<Vec3> vertices_m;
    bool remembered = true;  // false: the map had dropped it by the end
  };
  std::vector<Polygon> polygons;
  std::vector<Vec3> base_trail_m;
  std::array<std::vector<Vec3>, kFootCount> sole_trail_m;
};

// A complete SVG document: side view, top view, legend, scale bar, verdict. The same climb gives the same text.
[[nodiscard]] std::string climb_svg(const StairWorld& world, const ClimbDrawing& drawing, const ClimbSummary& summary);

}  // namespace polygmap::sim
