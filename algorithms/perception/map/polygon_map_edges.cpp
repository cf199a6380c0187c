// SPDX-License-Identifier: Apache-2.0
// The polygon map: nosing and back lines, the eight ends, and the polygon that they make.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "algorithms/perception/map/polygon_map.hpp"

namespace polygmap {
namespace {

constexpr double kMinArea_m2 = 1e-4;  // a polygon of less is degenerate

}  // namespace

std::optional<Vec3> PolygonMap::heading_from_lines() const noexcept {
  for (const EdgeLine* line : {&seen_.nosing, &seen_.back}) {
    if (!line->valid) continue;
    const Vec3 along = line->b_m - line->a_m;
    if (along.squaredNorm() < math::square(params_.lines.min_length_m)) continue;
    const Vec3 heading = along.cross(seen_.plane.normal).normalized();
    // From the nosing into the surface, out of it over the back edge.
    const double into = heading.dot(seen_.centroid_m - line->a_m) * (line == &seen_.nosing ? 1.0 : -1.0);
    return into >= 0.0 ? heading : Vec3{-heading};
  }
  return std::nullopt;
}

std::optional<SeenLine> PolygonMap::local_line(const MapTrack& track, const EdgeLine& line) const noexcept {
  if (!line.valid || track.kind != SurfaceKind::kTread) return std::nullopt;
  const SeenLine seen{local_xy(track.map_T_local, line.a_m), local_xy(track.map_T_local, line.b_m),
                      math::square(std::max(line.sigma_m, params_.least_sigma_m))};
  const Vec2 along = seen.b_m - seen.a_m;
  // More than 45 degrees off is no edge across the stairs.
  if (std::abs(along.y()) < params_.lines.min_length_m || std::abs(along.x()) > std::abs(along.y()))
    return std::nullopt;
  return seen;
}

void PolygonMap::turn_to(MapTrack& track, const Vec3& map_x) noexcept {
  Transform& frame = track.map_T_local;
  const Transform turned_frame{frame_from(frame.R.col(2), map_x), frame.p_m};
  const Mat2 new_R_old = (turned_frame.R.transpose() * frame.R).topLeftCorner<2, 2>();
  const double turn_rad = math::atan2(new_R_old(0, 1), new_R_old(0, 0));  // of the new x axis in the old frame
  frame = turned_frame;
  for (Vec2& v : track.polygon) v = new_R_old * v;
  const int shift = static_cast<int>(std::lround(turn_rad / (kPi / 4.0)));
  const std::array<TrackedSide, kMapSides> old = track.sides;
  for (std::size_t k = 0; k < kMapSides; ++k) {
    const auto from = static_cast<std::size_t>((static_cast<int>(k) + shift + 2 * static_cast<int>(kMapSides)) %
                                               static_cast<int>(kMapSides));
    track.sides[k] = old[from];
    track.sides[k].outlier_m.reset();  // of another direction
    track.sides[k].support_m = track.sides[k].reach_m = support_m(track.polygon, side_direction(k));
  }
  for (TrackedLine* line : {&track.nosing, &track.back}) {
    const Vec2 a = new_R_old * Vec2{line->at_m(-0.5), -0.5}, b = new_R_old * Vec2{line->at_m(0.5), 0.5};
    const Vec2 along = b - a;
    if (!(along.y() > params_.lines.across_min)) {  // it was no edge across the stairs
      *line = {};
      continue;
    }
    line->state[1] = along.x() / along.y();
    line->state[0] = a.x() - line->state[1] * a.y();
  }
}

bool PolygonMap::agrees(const TrackedLine& line, const SeenLine& seen) const noexcept {
  const Vec2 along = seen.b_m - seen.a_m, middle = 0.5 * (seen.a_m + seen.b_m);
  const double half_m = std::abs(along.y()) / math::sqrt(12.0);
  const double sigma = math::sqrt(seen.variance_m2 + std::min(line.variance_m2(middle.y()), 1.0));
  const double gate = math::clamp(params_.lines.sigmas * sigma, params_.lines.gate_min_m, params_.lines.gate_max_m);
  const double turn_gate =
      std::max(params_.lines.turn_gate, params_.lines.sigmas * math::sqrt(seen.variance_m2) / half_m);
  return std::abs(middle.x() - line.at_m(middle.y())) <= gate &&
         std::abs(along.x() / along.y() - line.state[1]) <= turn_gate;
}

void PolygonMap::update_line(TrackedLine& line, const SeenLine& seen) noexcept {
  const Vec2 along = seen.b_m - seen.a_m, middle = 0.5 * (seen.a_m + seen.b_m);
  const double slope = along.x() / along.y();
  // Two points that together carry the offset's variance and the slope's of a fit over the whole edge.
  const double half_m = std::abs(along.y()) / math::sqrt(12.0);
  const double variance = 2.0 * seen.variance_m2;
  if (line.sightings > 0 && !agrees(line, seen)) {
    ++counters_.line_outliers;
    if (++line.outliers < params_.outliers_to_reset) return;
    ++counters_.resets;
    line = {};
  }
  line.outliers = 0;
  line.information *= line.sightings > 0 ? faded(line.seen_ns) : 0.0;
  Vec2 gradient = Vec2::Zero();
  for (const double y : {middle.y() - half_m, middle.y() + half_m}) {
    const Vec2 h{1.0, y};
    const double x = middle.x() + slope * (y - middle.y());
    line.information += h * h.transpose() / variance;
    gradient += h * ((x - h.dot(line.state)) / variance);
  }
  line.state += line.information.inverse() * gradient;
  line.seen_ns = newest_ns_;
  line.seen_from = viewpoint();
  ++line.sightings;
}

void PolygonMap::update_back(MapTrack& track) noexcept {
  constexpr std::int32_t kMostDrops = 8;
  const std::optional<SeenLine> seen = local_line(track, seen_.back);
  if (!seen) return;
  update_line(track.back, *seen);
  track.back_drops = std::clamp(track.back_drops + (seen_.back_drops ? 1 : -1), -kMostDrops, kMostDrops);
}

void PolygonMap::update_sides(MapTrack& track, bool first) noexcept {
  for (std::size_t k = 0; k < kMapSides; ++k) {
    const Vec2 u = side_direction(k);
    const double support = support_m(seen_local_, u);
    const bool observed = end_observed(params_.ends, seen_local_, seen_.edges, u, support);
    TrackedSide& side = track.sides[k];
    if (first) {
      const double reach_m = support - params_.sides.unknown_margin_m;
      side = {observed ? support : reach_m,
              reach_m,
              1.0 / math::square(params_.sides.sigma_m),
              newest_ns_,
              0.0,
              0,
              observed};
    } else {
      update_side(side, support, observed);
    }
  }
}

void PolygonMap::update_side(TrackedSide& side, double seen_m, bool observed) noexcept {
  const double weight = 1.0 / math::square(params_.sides.sigma_m);
  // Certainly surface up to here, in this frame and in the one before.
  const double seen_reach_m = seen_m - params_.sides.unknown_margin_m;
  const double reach_m = std::min(seen_reach_m, std::exchange(side.reach_m, seen_reach_m));
  // Where the surface is seen to go on beyond such an end, a leg split it there.
  if (!observed && side.outlier_m && seen_reach_m > *side.outlier_m) side.outliers = 0;
  if (!observed && !side.observed) {
    side.support_m = std::max(side.support_m, reach_m);
    return;
  }
  if (!observed && reach_m < side.support_m + params_.sides.gate_m) return;  // nothing new
  const bool agrees = observed && std::abs(seen_m - side.support_m) < params_.sides.gate_m;
  if (agrees && side.observed) {
    side.information = side.information * faded(side.seen_ns) + weight;
    side.support_m += weight / side.information * (seen_m - side.support_m);
    side.seen_ns = newest_ns_;
    side.outliers = 0;
    return;
  }
  // The first observed end that does not cut off what was seen counts at once; contradictions must persist.
  const bool extends = observed && !side.observed && seen_m > side.support_m;
  if (!extends) {
    ++counters_.side_outliers;
    if (observed) {  // other ends than the last one's say nothing together; who sees beyond an end says so anyhow
      if (!side.outlier_m || std::abs(seen_m - *side.outlier_m) > params_.sides.gate_m) side.outliers = 0;
      side.outlier_m = seen_m;
    } else {
      side.outlier_m.reset();
    }
    if (++side.outliers < params_.outliers_to_reset) return;
    ++counters_.resets;
  }
  side = {observed ? seen_m : reach_m, seen_reach_m, weight, newest_ns_, {}, 0, observed};
}

void PolygonMap::rebuild(MapTrack& track) noexcept {
  const std::array<TrackedSide, kMapSides>& s = track.sides;
  const bool has_nosing = track.nosing.sightings >= params_.lines.min_sightings;
  const bool has_back = track.back.sightings >= params_.lines.min_sightings;
  const auto build = [&](bool use_nosing, bool use_back, EdgeTags& tags) {
    // Where a line decides, the box gives way to it at both ends, by any length: the line cuts it off again.
    constexpr double kBeyond_m = 0.01;
    double x_min = -s[4].support_m, x_max = s[0].support_m;
    const double y_min = -s[6].support_m, y_max = s[2].support_m;
    if (use_nosing) x_min = std::min(track.nosing.at_m(y_min), track.nosing.at_m(y_max)) - kBeyond_m;
    if (use_back) x_max = std::max(track.back.at_m(y_min), track.back.at_m(y_max)) + kBeyond_m;
    ConvexPolygon polygon;
    if (!(x_min < x_max) || !(y_min < y_max)) return polygon;
    for (const Vec2& v : {Vec2{x_min, y_min}, {x_max, y_min}, {x_max, y_max}, {x_min, y_max}}) {
      (void)polygon.try_push_back(v);
    }
    tags = {6, 0, 2, 4};
    const std::array<bool, kMapSides> sure{s[0].observed || use_back,   false, s[2].observed, false,
                                           s[4].observed || use_nosing, false, s[6].observed, false};
    for (std::size_t k = 1; k < kMapSides; k += 2) {
      // Between two observed ends the corner is theirs; depth images round corners off.
      if (sure[k - 1] && sure[(k + 1) % kMapSides]) continue;
      polygon = clip(polygon, {-side_direction(k), -s[k].support_m}, &tags, static_cast<std::uint8_t>(k));
    }
    // x >= offset + slope y, and the other way round.
    const auto clip_line = [&](const TrackedLine& line, double sign, std::uint8_t tag) {
      const double norm = math::sqrt(1.0 + math::square(line.state[1]));
      const Vec2 inward = sign / norm * Vec2{1.0, -line.state[1]};
      polygon = clip(polygon, {inward, sign * line.state[0] / norm}, &tags, tag);
    };
    if (use_nosing) clip_line(track.nosing, 1.0, kNosingTag);
    if (use_back) clip_line(track.back, -1.0, kBackTag);
    return polygon;
  };
  track.dirty = true;
  EdgeTags tags{};
  ConvexPolygon polygon = build(has_nosing, has_back, tags);
  if (area_m2(polygon) < kMinArea_m2 && (has_nosing || has_back)) {
    ++counters_.degenerate;
    polygon = build(false, false, tags);
    track.nosing = {};  // the next sighting says anew which way is up the stairs
    track.back = {};
    track.back_drops = 0;
  }
  if (area_m2(polygon) < kMinArea_m2) return;  // ends that cross: the old polygon stays
  track.polygon = polygon;
  track.tags = tags;
}

}  // namespace polygmap
