// SPDX-License-Identifier: Apache-2.0
// Things that the map knows to lie on a tread, as obstacles to the feet that are put there.
#pragma once

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/foothold/level_surface.hpp"

namespace polygmap {

struct ThingParams {
  double margin_m = 0.010;
  double side_margin_m = 0.010;
  double level_m = 0.03;
  double before_nosing_m = 0.02;
  double behind_m = 0.40;
  double low_m = 0.06;
  double top_area_m2 = 0.08;

  static void visit(auto& p, auto& field) {
    field("margin_m", p.margin_m, 0.0, 0.1, "A toe keeps from an occupied cell before it.");
    field("side_margin_m", p.side_margin_m, 0.0, 0.2, "A foot keeps from an occupied cell beside it.");
    field("level_m", p.level_m, 0.0, 0.039, "The ground of a cell on a tread is as near to the tread's height.");
    field("before_nosing_m", p.before_nosing_m, 0.0, 0.1,
          "A cell no farther before the nosing is on the tread: it may hang over.");
    field("behind_m", p.behind_m, 0.1, 3.0, "A cell farther behind the nosing is in no foot's way.");
    field("low_m", p.low_m, 0.0, 0.3, "What is no higher may lie between the feet.");
    field("top_area_m2", p.top_area_m2, 0.0, 1.0,
          "A level surface of no larger area above occupied cells is the top of a thing and no tread.");
  }
};

// Adds to the tread what lies on it, and is in the way of feet about middle_m, that reach as far to either side of it.
void add_things(const OccupiedCells& cells, const ThingParams& params, const SoleModel& sole, double middle_m,
                double feet_m, LevelSurface& tread, WorkCount& work) noexcept;

// Is the surface the top of something that lies there?
[[nodiscard]] bool is_top_of_thing(const OccupiedCells& cells, const ThingParams& params, const LevelSurface& surface,
                                   WorkCount& work) noexcept;

}  // namespace polygmap
