// SPDX-License-Identifier: Apache-2.0
#include "algorithms/foothold/things_on_tread.hpp"

#include <algorithm>
#include <cmath>

namespace polygmap {
namespace {

constexpr double kCellReach_m = 0.5 * kOccupiedCell_m;
constexpr std::size_t kMaxThings = 6;

}  // namespace

void add_things(const OccupiedCells& cells, const ThingParams& params, const SoleModel& sole, double middle_m,
                double feet_m, LevelSurface& tread, WorkCount& work) noexcept {
  const double aside_m = sole.collision.half_width_m + params.side_margin_m + kCellReach_m;
  // What one foot does not fit between is one thing.
  StaticVector<TreadObstacle, kMaxThings> things;
  work.add(cells.size(), 40);
  for (const OccupiedCell& cell : cells) {
    const Vec2 p_m{cell.x_m, cell.y_m};
    const double along_m = tread.along_m(p_m), lateral_m = tread.lateral_m(p_m);
    if (along_m < -params.before_nosing_m || along_m > params.behind_m) continue;
    if (std::abs(lateral_m - middle_m) > feet_m + aside_m) continue;
    if (std::abs(cell.ground_m - tread.plane.height_m(p_m)) > params.level_m) continue;
    work.add(60);
    work.add(things.size(), 12);
    const double end_m = along_m - kCellReach_m - sole.collision.toe_x_m;
    const Interval met{lateral_m - aside_m, lateral_m + aside_m};
    TreadObstacle* same = std::find_if(things.begin(), things.end(), [&](const TreadObstacle& o) {
      return met.min_m < o.sole_lateral_m.max_m && met.max_m > o.sole_lateral_m.min_m;
    });
    if (same == things.end()) {
      if (things.try_push_back({end_m, params.margin_m, met, cell.height_m <= params.low_m})) continue;
      same = things.begin();
    }
    same->low = same->low && cell.height_m <= params.low_m;
    same->sole_end_m = std::min(same->sole_end_m, end_m);
    same->sole_lateral_m.min_m = std::min(same->sole_lateral_m.min_m, met.min_m);
    same->sole_lateral_m.max_m = std::max(same->sole_lateral_m.max_m, met.max_m);
  }
  for (const TreadObstacle& thing : things) add_obstacle(tread, thing, middle_m);
}

bool is_top_of_thing(const OccupiedCells& cells, const ThingParams& params, const LevelSurface& surface,
                     WorkCount& work) noexcept {
  if (area_m2(surface.hull) > params.top_area_m2) return false;
  work.add(cells.size(), 20);
  return std::any_of(cells.begin(), cells.end(), [&](const OccupiedCell& cell) {
    const Vec2 p_m{cell.x_m, cell.y_m};
    const double top_m = cell.ground_m + cell.height_m;
    if (std::abs(top_m - surface.plane.height_m(p_m)) > params.level_m) return false;
    if (surface.plane.height_m(p_m) - cell.ground_m < 0.5 * cell.height_m) return false;
    return contains(surface.hull, p_m);
  });
}

}  // namespace polygmap
