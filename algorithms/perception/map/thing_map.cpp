// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/thing_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace polygmap {

void ThingMap::clear() noexcept {
  cells_.clear();
  index_.fill(0);
}

void ThingMap::begin(const View& view) noexcept {
  view_ = view;
  camera_T_map_ = view.map_T_camera.inverse();
  work_.add(150);
  work_.add(cells_.size(), 4);
  for (ThingCell& cell : cells_) cell.seen = false;
  may_make_room_ = true;
}

// The cells below the sighting, from its near to its far end.
void ThingMap::add(const ThingSighting& sighting) noexcept {
  constexpr double kStep_m = kOccupiedCell_m;
  constexpr std::int32_t kMostSteps = 16;  // what is longer is wider than a foot, too
  const Vec3 near_m = view_.map_T_camera * sighting.near_m, far_m = view_.map_T_camera * sighting.far_m;
  const Vec3 way_m = far_m - near_m;
  const auto steps = static_cast<std::int32_t>(std::min(std::ceil(way_m.norm() / kStep_m), kMostSteps + 0.0));
  work_.add(120);
  const Vec3 step_m = way_m / std::max(steps, 1);
  for (std::int32_t i = 0; i <= steps; ++i) mark(near_m + i * step_m, sighting.height_m);
}

void ThingMap::mark(const Vec3& ground_p_m, double height_m) noexcept {
  work_.add(60);
  ThingCell* cell = cell_for(static_cast<std::int32_t>(std::floor(ground_p_m.x() / kOccupiedCell_m)),
                             static_cast<std::int32_t>(std::floor(ground_p_m.y() / kOccupiedCell_m)));
  if (cell == nullptr) return;
  if (!cell->seen) {
    cell->seen = true;
    cell->count = std::min(cell->count + params_.seen, params_.most);
    cell->ground_m = ground_p_m.z();
    cell->height_m = 0.0;
  }
  cell->height_m = std::max(cell->height_m, height_m);
}

// That cell, made if need be; none where there is no room but for cells that are farther behind.
ThingCell* ThingMap::cell_for(std::int32_t x, std::int32_t y) noexcept {
  Index& index = index_of(x, y);
  if (index == 0) {
    ThingCell cell;
    cell.x = x;
    cell.y = y;
    if (cells_.try_push_back(cell)) {
      index = static_cast<Index>(cells_.size());
      return &cells_[cells_.size() - 1];
    }
    // What was not seen in this frame and is farthest from the camera makes room, once in a frame: a search of all
    // cells for each of a frame's cells would cost more than a picture.
    if (!std::exchange(may_make_room_, false)) return nullptr;
    work_.add(cells_.size(), 25);
    ThingCell* victim = nullptr;
    double farthest_m2 = 0.0;
    for (ThingCell& c : cells_) {
      const double distance_m2 = (c.at(0.0) - view_.map_T_camera.p_m).squaredNorm();
      if (c.seen || distance_m2 <= farthest_m2) continue;
      farthest_m2 = distance_m2;
      victim = &c;
    }
    if (victim == nullptr) return nullptr;
    index = std::exchange(index_of(victim->x, victim->y), 0);
    *victim = cell;
    return victim;
  }
  ThingCell& found = cells_[index - 1U];
  if (found.x != x || found.y != y) {  // of ground far behind
    found = ThingCell{};
    found.x = x;
    found.y = y;
  }
  return &found;
}

bool ThingMap::seen_free(const ThingCell& cell) const noexcept {
  if (view_.columns == nullptr) return false;
  const CameraIntrinsics& c = view_.intrinsics;
  const Vec3 p_m = camera_T_map_ * cell.at(0.5 * cell.height_m);
  if (p_m.z() < 0.1 || p_m.squaredNorm() > math::square(params_.range_m)) return false;
  const double u_px = c.cx_px + c.fx_px * p_m.x() / p_m.z(), v_px = c.cy_px + c.fy_px * p_m.y() / p_m.z();
  if (!(u_px >= 0.0) || !(v_px >= 0.0) || u_px >= c.width_px || v_px >= c.height_px) return false;
  const float inverse_depth =
      view_.columns->inverse_depth(static_cast<std::int32_t>(u_px) / kColumn_px, static_cast<std::int32_t>(v_px));
  if (!(inverse_depth > 0.0F)) return false;
  const Vec3 seen_m = view_.map_T_camera * Vec3{p_m / (p_m.z() * inverse_depth)};
  return seen_m.z() - cell.ground_m < params_.free_share * cell.height_m;
}

void ThingMap::look_again(std::size_t i) noexcept {
  ThingCell& cell = cells_[i];
  work_.add(cell.seen ? 12 : 150);
  if (!cell.seen && seen_free(cell)) --cell.count;
}

void ThingMap::finish(OccupiedCells& occupied) noexcept {
  work_.add(100);
  work_.add(cells_.size(), 20);
  occupied.clear();
  for (std::size_t i = cells_.size(); i-- > 0;) {
    ThingCell& cell = cells_[i];
    if (cell.count <= 0) {
      index_of(cell.x, cell.y) = 0;
      if (i + 1 < cells_.size()) {
        const ThingCell& last = cells_[cells_.size() - 1];
        index_of(last.x, last.y) = static_cast<Index>(i + 1);
      }
      (void)cells_.try_swap_remove(i);
      continue;
    }
    cell.occupied = cell.count >= (cell.occupied ? params_.occupied / 2 : params_.occupied);
    if (!cell.occupied) continue;
    const Vec3 ground_m = cell.at(0.0);
    (void)occupied.try_push_back({ground_m.x(), ground_m.y(), ground_m.z(), cell.height_m});
  }
}

}  // namespace polygmap
