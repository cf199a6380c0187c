// SPDX-License-Identifier: Apache-2.0
// The polygon map: what others get to see.
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "algorithms/perception/map/polygon_map.hpp"

namespace polygmap {

void PolygonMap::publish() noexcept {
  MapPolygons& out = snapshot_.polygons;
  work_.add(300);
  (void)out.try_resize(tracks_.size());
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    work_.add(340);
    if (tracks_[i].dirty) {
      write(tracks_[i], out[i]);
      work_.add(220);
      work_.add(tracks_[i].polygon.size(), 42);
    }
    tracks_[i].dirty = false;
    write_sigmas(tracks_[i], out[i].surface);
  }
  for (std::size_t i = tracks_.size(); i-- > 0;) {
    if (!tracks_[i].erased) continue;
    work_.add(240);
    (void)tracks_.try_swap_remove(i);
    (void)out.try_swap_remove(i);
  }
  ++counters_.frames;
  things_.finish(snapshot_.occupied);
  snapshot_.drift_m = drift_.drift_m();
  if (pass_.fused > 0) snapshot_.stamp_ns = newest_ns_;
}

void PolygonMap::write(const MapTrack& track, MapPolygon& out) const noexcept {
  const Transform& frame = track.map_T_local;
  const auto in_map = [&frame](const Vec2& p) { return Vec3{frame * Vec3{p.x(), p.y(), 0.0}}; };
  SurfacePatch& surface = out.surface;
  surface.kind = track.kind;
  surface.normal = frame.R.col(2);
  surface.d_m = -surface.normal.dot(frame.p_m);
  surface.centroid_m = in_map(centroid_m(track.polygon));
  surface.area_m2 = area_m2(track.polygon);
  surface.rmse_m = track.rmse_m;
  surface.invalid_fraction = track.invalid_fraction;
  surface.polygon.clear();
  surface.nosing = {};
  surface.back = {};
  surface.back_drops = track.back_drops > 0;
  const std::size_t n = track.polygon.size();
  for (std::size_t i = 0; i < n && i < kMaxPolygonVertices; ++i) {
    const std::uint8_t tag = track.tags[i];
    (void)surface.polygon.try_push_back(in_map(track.polygon[i]));
    surface.edges[i] = tag >= kNosingTag || track.sides[tag].observed ? EdgeKind::kObserved : EdgeKind::kUnknown;
    if (tag < kNosingTag) continue;
    // Left end first, looking up the stairs; the polygon runs counter-clockwise.
    EdgeLine& line = tag == kNosingTag ? surface.nosing : surface.back;
    const Vec3 from = in_map(track.polygon[i]), to = in_map(track.polygon[i + 1 == n ? 0 : i + 1]);
    line.a_m = tag == kNosingTag ? from : to;
    line.b_m = tag == kNosingTag ? to : from;
    line.valid = true;
  }
  out.id = track.id;
  out.sightings = track.sightings;
  out.last_seen_ns = track.last_seen_ns;
}

// Against the robot, which stands where its map has it: the error of the pose is theirs in common, that of the camera's
// mount is not. It turned what was seen about the camera: a tread's height by its distance, an edge by its depth below.
void PolygonMap::write_sigmas(const MapTrack& track, SurfacePatch& out) const noexcept {
  const auto sigma = [&](double variance_m2, double turned_m2, std::int64_t seen_ns) {
    return math::sqrt(variance_m2 + math::square(params_.systematic_sigma_m) + turned_m2 +
                      math::square(params_.drift.walk_m_per_sqrt_s) * seconds(newest_ns_ - seen_ns));
  };
  const Viewpoint& from = track.seen_from;
  const double mount_rad2 = math::square(from.mount_sigma_rad);
  const Vec3 arm_m = out.centroid_m - from.map_p_camera_m;
  out.offset_sigma_m =
      sigma(1.0 / track.offset_information, mount_rad2 * out.normal.cross(arm_m).squaredNorm(), track.last_seen_ns);
  out.tilt_sigma_rad = math::sqrt(1.0 / track.tilt_information + math::square(view_.tilt_sigma_rad) + mount_rad2);
  for (const auto& [line, edge] : {std::pair{&track.nosing, &out.nosing}, std::pair{&track.back, &out.back}}) {
    if (!edge->valid) continue;
    const Vec3 middle_m = 0.5 * (edge->a_m + edge->b_m);
    const double variance_m2 = line->variance_m2(local_xy(track.map_T_local, middle_m).y());
    const double depth_m = middle_m.z() - line->seen_from.map_p_camera_m.z();
    edge->sigma_m =
        sigma(std::min(variance_m2, 1.0), math::square(line->seen_from.mount_sigma_rad * depth_m), line->seen_ns);
  }
}

}  // namespace polygmap
