// SPDX-License-Identifier: Apache-2.0
// The polygon map: which remembered surface is it, and what does it say about where the frame lies?
#include <algorithm>
#include <utility>

#include "algorithms/perception/map/polygon_map.hpp"

namespace polygmap {
namespace {

// The shorter interval's part that both cover; negative: minus the gap.
double overlap_m(const Interval& a, const Interval& b) noexcept {
  return std::min(a.max_m, b.max_m) - std::max(a.min_m, b.min_m);
}
double length_m(const Interval& a) noexcept { return a.max_m - a.min_m; }

}  // namespace

ConvexPolygon PolygonMap::local_polygon(const MapTrack& track) const noexcept {
  ConvexPolygon out;
  for (const Vec3& v : seen_.polygon) (void)out.try_push_back(local_xy(track.map_T_local, v));
  return out;
}

// The cheap part of the comparison, which most pairs do not pass.
bool PolygonMap::is_near(const MapTrack& track, Nearness& out) const noexcept {
  if (track.erased || track.kind != seen_.kind || track.polygon.size() < 3) return false;
  const bool upright = track.kind == SurfaceKind::kRiser;
  const Vec3 normal = track.map_T_local.R.col(2);
  if (normal.dot(seen_.plane.normal) <
      math::cos(upright ? params_.match.upright_turn_gate_rad : params_.match.tilt_gate_rad)) {
    return false;
  }
  const Vec3 offset = seen_.centroid_m - track.map_T_local.p_m;
  out.across_m = normal.dot(offset);
  if (std::abs(out.across_m) > (upright ? params_.match.upright_gate_m : params_.match.height_gate_max_m)) return false;
  out.variance_m2 =
      seen_.offset_variance_m2 + 1.0 / track.offset_information + offset.squaredNorm() / track.tilt_information;
  out.gate_m = upright ? params_.match.upright_gate_m
                       : math::clamp(params_.match.height_sigmas * math::sqrt(out.variance_m2 + seen_.pose_variance_m2),
                                     params_.match.height_gate_min_m, params_.match.height_gate_max_m);
  return std::abs(out.across_m) <= out.gate_m;
}

bool PolygonMap::two_posts(const MapTrack& track, const ConvexPolygon& seen_polygon, bool behind) const noexcept {
  const Vec2 u = side_direction(behind ? 4 : 0);
  return track.sides[behind ? 0 : 4].observed &&
         end_observed(params_.ends, seen_polygon, seen_.edges, u, support_m(seen_polygon, u));
}

bool PolygonMap::matches(const MapTrack& track, const Nearness& near, double& cost) noexcept {
  work_.add(330);
  work_.add(seen_.polygon.size() + track.polygon.size(), 34);
  const bool upright = track.kind == SurfaceKind::kRiser;
  const ConvexPolygon seen_polygon = local_polygon(track);
  const BoundingBox seen = bounding_box(seen_polygon), known = bounding_box(track.polygon);
  const Interval seen_x{seen.min_m.x(), seen.max_m.x()}, known_x{known.min_m.x(), known.max_m.x()};
  const Interval seen_y{seen.min_m.y(), seen.max_m.y()}, known_y{known.min_m.y(), known.max_m.y()};
  const double overlap_x_m = overlap_m(seen_x, known_x), overlap_y_m = overlap_m(seen_y, known_y);
  if (track.kind == SurfaceKind::kOther) {
    if (std::min(overlap_x_m, overlap_y_m) < -params_.match.other_gap_m) return false;
  } else {
    const double shorter_m =
        upright ? std::min(length_m(seen_y), length_m(known_y)) : std::min(length_m(seen_x), length_m(known_x));
    if ((upright ? overlap_y_m : overlap_x_m) < params_.match.overlap_fraction * shorter_m) return false;
    if ((upright ? overlap_x_m : overlap_y_m) < -params_.match.lateral_gap_m) return false;
    if (upright && overlap_x_m < 0.0 && two_posts(track, seen_polygon, seen_x.min_m > known_x.min_m)) return false;
  }
  cost = std::abs(near.across_m) / near.gate_m + (std::min(overlap_x_m, overlap_y_m) > 0.0 ? 0.0 : 1.0);
  return true;
}

void PolygonMap::compare_some() noexcept {
  constexpr std::size_t kAtOnce = 16;
  for (std::size_t glances = 0; glances < kAtOnce && pass_.track < tracks_.size(); ++glances, ++pass_.track) {
    Nearness near;
    work_.add(105);
    if (!is_near(tracks_[pass_.track], near)) continue;
    double cost = 0.0;
    if (!matches(tracks_[pass_.track], near, cost)) continue;
    if (cost < pass_.best_cost) {
      pass_.second = pass_.best;
      pass_.second_cost = pass_.best_cost;
      pass_.best = pass_.track;
      pass_.best_cost = cost;
    } else if (cost < pass_.second_cost) {
      pass_.second = pass_.track;
      pass_.second_cost = cost;
    }
  }
}

// What the seen surface says about the frame's offset: along the remembered normal, and across the edges of a tread.
void PolygonMap::measure_offset() noexcept {
  work_.add(60);
  if (pass_.best >= tracks_.size()) return;
  const MapTrack& track = tracks_[pass_.best];
  Nearness near;
  if (track.sightings < params_.memory.confirmed_sightings || !is_near(track, near)) return;
  work_.add(900);
  if (track.kind == SurfaceKind::kTread) work_.add(seen_.polygon.size(), 90);
  const double common_m2 = math::square(params_.systematic_sigma_m);
  // A riser is matched from further off than it may lie; a plane's normal says nothing about its place beside it.
  if (std::abs(near.across_m) < params_.lines.gate_max_m) {
    drift_.add(track.map_T_local.R.col(2), near.across_m, near.variance_m2 + common_m2);
  }
  for (const auto& [edge, line] : {std::pair{&seen_.nosing, &track.nosing}, std::pair{&seen_.back, &track.back}}) {
    const std::optional<SeenLine> seen = local_line(track, *edge);
    if (!seen || line->sightings < params_.lines.min_sightings || !agrees(*line, *seen)) continue;
    const Vec2 middle_m = 0.5 * (seen->a_m + seen->b_m);
    const double norm = math::sqrt(1.0 + math::square(line->state[1]));
    drift_.add(track.map_T_local.R * Vec3{1.0 / norm, -line->state[1] / norm, 0.0},
               (middle_m.x() - line->at_m(middle_m.y())) / norm,
               seen->variance_m2 + std::min(line->variance_m2(middle_m.y()), 1.0) + common_m2);
  }
  if (track.kind != SurfaceKind::kTread) return;
  const ConvexPolygon seen = local_polygon(track);
  for (const std::size_t k : {kLeftSide, kRightSide}) {
    const TrackedSide& side = track.sides[k];
    const Vec2 u = side_direction(k);
    const double support = support_m(seen, u);
    if (!side.observed || std::abs(support - side.support_m) > params_.sides.gate_m) continue;
    if (!end_observed(params_.ends, seen, seen_.edges, u, support)) continue;
    drift_.add(track.map_T_local.R * Vec3{u.x(), u.y(), 0.0}, support - side.support_m,
               math::square(params_.sides.sigma_m) + 1.0 / side.information + common_m2);
  }
}

}  // namespace polygmap
