// SPDX-License-Identifier: Apache-2.0
// The polygon map: surfaces that are created, fused, merged, and dropped.
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "algorithms/perception/map/polygon_map.hpp"

namespace polygmap {
void PolygonMap::fuse_best() noexcept {
  // Of a track: its eight ends, its polygon; of a new one no end is known before.
  constexpr std::int32_t kRebuild = 6500, kCreate = 3200, kPerCorner = 420;
  const bool is_new = pass_.best >= tracks_.size();
  work_.add(is_new ? kCreate : kRebuild);
  work_.add(seen_.polygon.size(), kPerCorner);
  if (is_new) {
    ++pass_.fused;
    create();
    return;
  }
  MapTrack* keep = &tracks_[pass_.best];
  MapTrack* gone = nullptr;
  // One surface that lies on two remembered ones says that they are one.
  if (pass_.second < tracks_.size() && pass_.best_cost < 1.0 && pass_.second_cost < 1.0) {
    gone = &tracks_[pass_.second];
    if (gone->sightings > keep->sightings || (gone->sightings == keep->sightings && gone->id < keep->id)) {
      std::swap(keep, gone);
    }
  }
  // A riser is matched from further off than it may have moved.
  const Transform& frame = keep->map_T_local;
  const double offset_m = -seen_.plane.distance_m(frame.p_m) / frame.R.col(2).dot(seen_.plane.normal);
  const bool outlier = std::abs(offset_m) > params_.lines.gate_max_m;
  if (outlier) {
    ++counters_.plane_outliers;
    if (++keep->outliers.planes < params_.outliers_to_reset) return;
    ++counters_.resets;
  }
  if (gone != nullptr) merge(*keep, *gone);
  fuse(*keep, offset_m, outlier ? 0.0 : faded(keep->last_seen_ns));
  ++pass_.fused;
  ++counters_.fused;
}

void PolygonMap::create() noexcept {
  MapTrack track;
  track.id = next_id_++;
  track.kind = seen_.kind;
  track.sightings = 1;
  track.last_seen_ns = newest_ns_;
  track.seen_from = viewpoint();
  const Vec3 normal = seen_.plane.normal;
  const Vec3 level = Vec3::UnitZ().cross(normal);  // horizontal; x of an upright surface, so that y is up
  // Optical axis and the picture's up together point ahead at any camera pitch.
  const Vec3 ahead = map_T_camera_.R.col(2) - map_T_camera_.R.col(1);
  Vec3 x_hint = track.kind == SurfaceKind::kTread ? ahead : level;
  if (track.kind == SurfaceKind::kTread) {
    if (const std::optional<Vec3> heading = heading_from_lines()) x_hint = *heading;
  }
  track.map_T_local = {frame_from(normal, x_hint), seen_.centroid_m};
  track.offset_information = 1.0 / seen_.offset_variance_m2;
  track.tilt_information = 1.0 / seen_.tilt_variance_rad2;
  track.rmse_m = seen_.rmse_m;
  track.invalid_fraction = seen_.invalid_fraction;
  seen_local_ = local_polygon(track);
  if (const auto line = local_line(track, seen_.nosing)) update_line(track.nosing, *line);
  update_back(track);
  update_sides(track, true);
  rebuild(track);
  if (track.polygon.size() < 3) {
    ++counters_.rejected_surfaces;
    return;
  }
  const bool worth_a_place = track.kind != SurfaceKind::kOther ||
                             (area_m2(track.polygon) >= params_.memory.other_area_min_m2 && priority(track) > 0);
  if (!worth_a_place) {
    ++counters_.passed_over;
    return;
  }
  admit(track);
}

// What is worth keeping when the map is full.
int PolygonMap::priority(const MapTrack& track) const noexcept {
  const Vec2 eye_m = local_xy(track.map_T_local, map_T_camera_.p_m);
  // A long floor's middle may be far from where the robot stands on it.
  const double distance_m = track.kind == SurfaceKind::kTread
                                ? -signed_distance_m(track.polygon, eye_m)
                                : (track.map_T_local.p_m - map_T_camera_.p_m).head<2>().norm();
  if (track.erased || distance_m > params_.memory.reach_m) return 0;
  return (track.kind == SurfaceKind::kOther ? 1 : 3) + (track.sightings < params_.memory.confirmed_sightings ? 0 : 1);
}

void PolygonMap::admit(const MapTrack& track) noexcept {
  if (!tracks_.try_push_back(track)) {
    // The least worth keeping goes, of these the one not seen for longest.
    std::size_t victim = 0;
    int least = priority(tracks_[0]);
    for (std::size_t i = 1; i < tracks_.size(); ++i) {
      work_.add(tracks_[i].kind == SurfaceKind::kTread ? 330 : 80);  // a tread's polygon is gone round
      const int worth = priority(tracks_[i]);
      if (worth < least || (worth == least && tracks_[i].last_seen_ns < tracks_[victim].last_seen_ns)) {
        victim = i;
        least = worth;
      }
    }
    // Never for something of less worth, nor one surface of this frame for its like.
    const int own_priority = priority(track);
    if (least > own_priority || (least == own_priority && tracks_[victim].last_seen_ns == newest_ns_)) {
      ++counters_.refused;
      return;
    }
    ++(least > 0 ? counters_.evicted : counters_.forgotten);
    tracks_[victim] = track;
  }
  ++counters_.created;
}

void PolygonMap::fuse(MapTrack& track, double offset_m, double fade) noexcept {
  if (track.last_seen_ns != newest_ns_) ++track.sightings;
  track.last_seen_ns = newest_ns_;
  track.seen_from = viewpoint();
  track.misses = 0;
  track.outliers.planes = 0;
  track.rmse_m += params_.rmse_gain * (seen_.rmse_m - track.rmse_m);
  track.invalid_fraction = seen_.invalid_fraction;

  // The plane: offset along the normal at the local origin, and tilt about it.
  Transform& frame = track.map_T_local;
  Vec3 normal = frame.R.col(2);
  const double cosine = normal.dot(seen_.plane.normal);
  const double lever2_m2 = (seen_.centroid_m - frame.p_m).squaredNorm();
  const double weight = 1.0 / (seen_.offset_variance_m2 + seen_.tilt_variance_rad2 * lever2_m2);
  track.offset_information = track.offset_information * fade + weight;
  frame.p_m += (weight / track.offset_information) * offset_m * normal;
  track.tilt_information = track.tilt_information * fade + 1.0 / seen_.tilt_variance_rad2;
  const double tilt_gain = 1.0 / (seen_.tilt_variance_rad2 * track.tilt_information);
  normal = (normal + tilt_gain * (seen_.plane.normal - cosine * normal)).normalized();
  frame.R = frame_from(normal, frame.R.col(0));

  if (track.kind == SurfaceKind::kTread) {
    if (faces_as(track)) {
      if (const auto nosing = local_line(track, seen_.nosing)) update_line(track.nosing, *nosing);
      update_back(track);
    }
    const TrackedLine& reference = track.nosing.sightings >= params_.lines.min_sightings ? track.nosing : track.back;
    if (reference.sightings >= params_.lines.min_sightings && std::abs(reference.state[1]) > params_.turn_slope) {
      turn_to(track, frame.R * Vec3{1.0, -reference.state[1], 0.0});
    }
  }
  seen_local_ = local_polygon(track);
  update_sides(track, false);
  rebuild(track);
}

// Whether the frame's lines are those of the track's axes. From another side, as on a landing or on the way back,
// another edge is the front one: seen again and again, and no worse, the axes turn to it; and at once where no line is
// sure yet.
bool PolygonMap::faces_as(MapTrack& track) noexcept {
  constexpr double kAside_cos = 0.70;
  const std::optional<Vec3> heading = heading_from_lines();
  if (!heading) return true;
  const bool has_lines = track.nosing.sightings > 0 || track.back.sightings > 0;
  if (has_lines && heading->dot(track.map_T_local.R.col(0)) >= kAside_cos) {
    track.outliers.fronts = 0;
    return true;
  }
  const std::uint32_t sure = params_.lines.min_sightings;
  const bool is_sure = track.nosing.sightings >= sure || track.back.sightings >= sure;
  if (is_sure && ++track.outliers.fronts < params_.outliers_to_reset) return false;
  track.outliers.fronts = 0;
  track.nosing = track.back = {};
  track.back_drops = 0;
  turn_to(track, *heading);
  return true;
}

void PolygonMap::merge(MapTrack& into, MapTrack& from) noexcept {
  work_.add(300 + static_cast<std::int32_t>(kMapSides * from.polygon.size()) * 45);
  // The other one is one more sighting of where the surface reaches.
  const Transform into_T_from = into.map_T_local.inverse() * from.map_T_local;
  for (std::size_t k = 0; k < kMapSides; ++k) {
    const Vec2 u = side_direction(k);
    for (const Vec2& v : from.polygon) {
      const double reach_m = u.dot((into_T_from * Vec3{v.x(), v.y(), 0.0}).head<2>());
      if (!into.sides[k].observed) into.sides[k].support_m = std::max(into.sides[k].support_m, reach_m);
    }
  }
  into.sightings = std::max(into.sightings, from.sightings);
  from.erased = true;
  ++counters_.merged;
}

bool PolygonMap::in_view(const MapTrack& track, const Transform& camera_T_local) const noexcept {
  const Vec2 middle = centroid_m(track.polygon);
  const Vec3 centre = camera_T_local * Vec3{middle.x(), middle.y(), 0.0};
  const double range_m = centre.norm();
  const double incidence = -camera_T_local.R.col(2).dot(centre) / std::max(range_m, 1e-6);
  if (range_m > params_.plain_view.range_m || incidence < params_.plain_view.min_incidence) return false;
  const CameraIntrinsics& c = view_.intrinsics;
  for (const Vec2& v : track.polygon) {
    const Vec2 inner = 0.5 * (v + middle);
    const Vec3 p = camera_T_local * Vec3{inner.x(), inner.y(), 0.0};
    if (p.z() < 0.1) return false;
    const double u_px = c.cx_px + c.fx_px * p.x() / p.z(), v_px = c.cy_px + c.fy_px * p.y() / p.z();
    if (u_px < params_.plain_view.margin_px || u_px > c.width_px - params_.plain_view.margin_px) return false;
    if (v_px < params_.plain_view.margin_px || v_px > c.height_px - params_.plain_view.margin_px) return false;
  }
  return true;
}

// By the robot's own body: three of five points, the middle and four halfway to vertices around it.
bool PolygonMap::hidden(const MapTrack& track, const Transform& camera_T_local) noexcept {
  constexpr std::size_t kAround = 4;
  const Vec2 middle = centroid_m(track.polygon);
  std::size_t hidden = 0;
  for (std::size_t i = 0; i <= kAround; ++i) {
    const Vec2 towards = i == kAround ? middle : track.polygon[i * track.polygon.size() / kAround];
    const Vec2 inner = 0.5 * (towards + middle);
    const Vec3 p = camera_T_local * Vec3{inner.x(), inner.y(), 0.0};
    const double margin_m = view_.body_margin.at(p.norm());
    hidden += hides(view_.body[0], margin_m, p, work_) || hides(view_.body[1], margin_m, p, work_) ? 1U : 0U;
  }
  return 2 * hidden > kAround;
}

void PolygonMap::age(MapTrack& track) noexcept {
  if (track.erased || track.last_seen_ns == newest_ns_) return;
  work_.add(400);
  work_.add(track.polygon.size(), 75);
  const Transform camera_T_local = map_T_camera_.inverse() * track.map_T_local;
  const bool looked = in_view(track, camera_T_local);
  if (looked) work_.add(750);
  if (looked && !hidden(track, camera_T_local)) ++track.misses;
  const bool confirmed = track.sightings >= params_.memory.confirmed_sightings;
  if (confirmed && track.misses >= params_.memory.misses_confirmed) {
    track.erased = true;
    ++counters_.dropped_vanished;
  } else if (!confirmed && (track.misses >= params_.memory.misses_unconfirmed ||
                            seconds(newest_ns_ - track.last_seen_ns) > params_.memory.unconfirmed_age_s)) {
    track.erased = true;
    ++counters_.dropped_unconfirmed;
  }
}

double PolygonMap::faded(std::int64_t since_ns) const noexcept {
  return math::exp(-seconds(newest_ns_ - since_ns) / params_.window_s);
}

}  // namespace polygmap
