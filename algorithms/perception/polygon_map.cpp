// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygon_map.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <utility>

namespace polygmap {
namespace {

// Work units, of 300 to 500 instructions.
constexpr std::int32_t kLoadUnits = 2;
constexpr std::int32_t kMatchUnits = 2;
constexpr std::int32_t kMeasureUnits = 2;
constexpr std::int32_t kFuseUnits = 12;
constexpr std::int32_t kEvictUnits = 20;

constexpr double kMinSigma_m = 0.0005;  // a frame that claims more than this is not believed
constexpr double kMinTilt_rad = 0.0005;
constexpr double kMaxRange_m = 10.0;
constexpr double kEndTolerance_m = 0.015;  // edges this near the farthest vertex make up an end
constexpr double kMinEndLength_m = 0.02;
constexpr double kMaxLocalSlope = 0.05;  // steeper: the local axes turn to the line
constexpr double kMinArea_m2 = 1e-4;
constexpr std::uint8_t kNosingTag = 8;  // tags below are side indices
constexpr std::uint8_t kBackTag = 9;

constexpr std::size_t kLeftSide = 2, kRightSide = 6;

double turned(std::size_t side) noexcept { return static_cast<double>(side) * (kPi / 4.0); }

// The shorter interval's part that both cover; negative: minus the gap.
double overlap_m(const Interval& a, const Interval& b) noexcept {
  return std::min(a.max_m, b.max_m) - std::max(a.min_m, b.min_m);
}
double length_m(const Interval& a) noexcept { return a.max_m - a.min_m; }

bool valid(const SurfacePatch& patch) noexcept {
  if (patch.polygon.size() < 3 || !math::all_finite(patch.normal) || !math::all_finite(patch.centroid_m)) return false;
  if (!(std::abs(patch.normal.squaredNorm() - 1.0) < 1e-3) ||
      !(patch.centroid_m.squaredNorm() < math::square(kMaxRange_m))) {
    return false;
  }
  if (!std::isfinite(patch.d_m) || !(patch.offset_sigma_m >= 0.0) || !(patch.offset_sigma_m < 1.0)) return false;
  if (!(patch.tilt_sigma_rad >= 0.0) || !(patch.tilt_sigma_rad < 1.0)) return false;
  for (const Vec3& v : patch.polygon) {
    if (!(v.squaredNorm() < math::square(kMaxRange_m))) return false;
  }
  for (const EdgeLine* line : {&patch.nosing, &patch.back}) {
    if (!line->valid) continue;
    if (!math::all_finite(line->a_m) || !math::all_finite(line->b_m) || !(line->sigma_m >= 0.0) ||
        !(line->sigma_m < 1.0)) {
      return false;
    }
  }
  return true;
}

bool valid(const PolygonMap::View& view) noexcept {
  const Mat3& R = view.world_T_camera.R;
  return math::all_finite(R) && math::all_finite(view.world_T_camera.p_m) &&
         (R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-6 && view.position_sigma_m >= 0.0 &&
         std::isfinite(view.position_sigma_m) && view.tilt_sigma_rad >= 0.0 && std::isfinite(view.tilt_sigma_rad) &&
         view.intrinsics.fx_px > 0.0 && view.intrinsics.fy_px > 0.0;
}

EdgeLine moved(const Transform& a_T_b, const EdgeLine& line) noexcept {
  EdgeLine out = line;
  out.a_m = a_T_b * line.a_m;
  out.b_m = a_T_b * line.b_m;
  return out;
}

Vec2 local_xy(const Transform& world_T_local, const Vec3& world_m) noexcept {
  return (world_T_local.R.transpose() * (world_m - world_T_local.p_m)).head<2>();
}

// A right-handed frame with z along the unit normal and x as near to the given direction as that allows.
Mat3 frame_from(const Vec3& normal, const Vec3& x_hint) noexcept {
  Vec3 x = x_hint - normal.dot(x_hint) * normal;
  if (!(x.squaredNorm() > 1e-8)) x = normal.unitOrthogonal();
  x.normalize();
  Mat3 R;
  R << x, normal.cross(x), normal;
  return R;
}

// Is the farthest end of the polygon in direction u one that was really seen to end? The edges along that end decide;
// a mere corner counts when both its edges were seen.
bool end_observed(const ConvexPolygon& polygon, const std::array<EdgeKind, kMaxPolygonVertices>& edges, const Vec2& u,
                  double support) noexcept {
  const std::size_t n = polygon.size();
  double observed_m = 0.0, unknown_m = 0.0;
  std::size_t corner = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = polygon[i + 1 == n ? 0 : i + 1];
    if (u.dot(a) > u.dot(polygon[corner])) corner = i;
    if (u.dot(a) < support - kEndTolerance_m || u.dot(b) < support - kEndTolerance_m) continue;
    (edges[i] == EdgeKind::kObserved ? observed_m : unknown_m) += math::sqrt((b - a).squaredNorm());
  }
  if (observed_m + unknown_m > kMinEndLength_m) return observed_m > unknown_m;
  return edges[corner] == EdgeKind::kObserved && edges[corner == 0 ? n - 1 : corner - 1] == EdgeKind::kObserved;
}

}  // namespace

double TrackedLine::variance_m2(double y_m) const noexcept {
  const double det = information.determinant();
  if (!(det > 0.0)) return std::numeric_limits<double>::infinity();
  return (information(1, 1) - 2.0 * y_m * information(0, 1) + y_m * y_m * information(0, 0)) / det;
}

void PolygonMap::clear() noexcept {
  tracks_.clear();
  snapshot_.polygons.clear();
  snapshot_.stamp_ns = 0;
  snapshot_.drift_m.setZero();
  drift_.clear();
  any_frame_ = false;
  newest_ns_ = 0;
  stage_ = Stage::kIdle;
}

void PolygonMap::begin(const SurfaceFrame& frame, const View& view) noexcept {
  if (stage_ != Stage::kIdle) ++counters_.abandoned_frames;
  stage_ = Stage::kIdle;
  if (!valid(view)) {
    ++counters_.rejected_frames;
    return;
  }
  if (any_frame_ && frame.stamp_ns <= newest_ns_) {
    ++counters_.stale_frames;
    return;
  }
  frame_ = frame;
  view_ = view;
  newest_ns_ = frame.stamp_ns;
  any_frame_ = true;
  fused_in_frame_ = 0;
  order_surfaces();
  drift_.begin_frame(frame.stamp_ns, view.position_sigma_m);
  map_T_camera_ = view.world_T_camera;
  map_T_camera_.p_m -= drift_.drift_m();
  measuring_ = drift_.possible();
  patch_ = 0;
  stage_ = Stage::kLoad;
  if (!measuring_) begin_fusing();
}

// Where the map is nearly full, what a foot needs finds its place first.
void PolygonMap::order_surfaces() noexcept {
  order_.clear();
  for (const bool others : {false, true}) {
    for (std::size_t i = 0; i < frame_.surfaces.size(); ++i) {
      if ((frame_.surfaces[i].kind == SurfaceKind::kOther) != others) continue;
      (void)order_.try_push_back(static_cast<std::uint8_t>(i));
    }
    if (!others) telling_ = order_.size();
  }
}

void PolygonMap::begin_fusing() noexcept {
  if (measuring_) drift_.end_frame();
  measuring_ = false;
  map_T_camera_.p_m = view_.world_T_camera.p_m - drift_.frame_offset_m();
  patch_ = 0;
}

void PolygonMap::next_surface() noexcept {
  track_ = 0;
  if (measuring_ && patch_ >= telling_) return begin_fusing();
  if (patch_ >= order_.size()) {
    stage_ = Stage::kAge;
  } else if (load(frame_.surfaces[order_[patch_]])) {
    best_ = second_ = kMaxMapPolygons;
    best_cost_ = second_cost_ = std::numeric_limits<double>::infinity();
    stage_ = Stage::kCompare;
  } else {
    if (!measuring_) ++counters_.rejected_surfaces;
    ++patch_;
  }
}

Progress PolygonMap::step(WorkBudget& budget) noexcept {
  if (stage_ == Stage::kIdle) return Progress::kIdle;
  while (!budget.exhausted()) {
    switch (stage_) {
      case Stage::kLoad:
        budget.spend(kLoadUnits);
        next_surface();
        break;
      case Stage::kCompare:
        budget.spend(compare_some());
        if (track_ >= tracks_.size()) stage_ = Stage::kFuse;
        break;
      case Stage::kFuse:
        if (measuring_) {
          budget.spend(kMeasureUnits);
          measure_offset();
        } else {
          budget.spend(kFuseUnits + (best_ >= tracks_.size() && tracks_.full() ? kEvictUnits : 0));
          fuse_best();
        }
        ++patch_;
        stage_ = Stage::kLoad;
        break;
      case Stage::kAge:
        budget.spend(1);
        if (track_ < tracks_.size()) {
          age(tracks_[track_++]);
        } else {
          stage_ = Stage::kPublish;
        }
        break;
      case Stage::kPublish:
        budget.spend(publish());
        stage_ = Stage::kIdle;
        return Progress::kDone;
      case Stage::kIdle:
        return Progress::kIdle;
    }
  }
  return Progress::kBusy;
}

bool PolygonMap::load(const SurfacePatch& patch) noexcept {
  if (!valid(patch)) return false;
  seen_.kind = patch.kind;
  seen_.plane = map_T_camera_ * Plane{patch.normal.normalized(), patch.d_m};
  const double up = seen_.plane.normal.z();
  if (seen_.plane.distance_m(map_T_camera_.p_m) <= 0.0) return false;  // seen from behind
  if (patch.kind == SurfaceKind::kTread && up < 0.8) return false;
  if (patch.kind == SurfaceKind::kRiser && std::abs(up) > 0.5) return false;
  seen_.centroid_m = seen_.plane.project(map_T_camera_ * patch.centroid_m);
  seen_.offset_variance_m2 = math::square(std::max(patch.offset_sigma_m, kMinSigma_m));
  seen_.tilt_variance_rad2 = math::square(std::max(patch.tilt_sigma_rad, kMinTilt_rad));
  const double range2_m2 = (seen_.centroid_m - map_T_camera_.p_m).squaredNorm();
  seen_.pose_variance_m2 = math::square(view_.position_sigma_m) + math::square(view_.tilt_sigma_rad) * range2_m2;
  seen_.rmse_m = patch.rmse_m;
  seen_.invalid_fraction = patch.invalid_fraction;
  seen_.polygon.clear();
  for (const Vec3& v : patch.polygon) (void)seen_.polygon.try_push_back(seen_.plane.project(map_T_camera_ * v));
  seen_.edges = patch.edges;
  seen_.nosing = moved(map_T_camera_, patch.nosing);
  seen_.back = moved(map_T_camera_, patch.back);
  return true;
}

ConvexPolygon PolygonMap::local_polygon(const MapTrack& track) const noexcept {
  ConvexPolygon out;
  for (const Vec3& v : seen_.polygon) (void)out.try_push_back(local_xy(track.world_T_local, v));
  return out;
}

// The cheap part of the comparison, which most pairs do not pass.
bool PolygonMap::is_near(const MapTrack& track, Nearness& out) const noexcept {
  if (track.dead || track.kind != seen_.kind || track.polygon.size() < 3) return false;
  const bool upright = track.kind == SurfaceKind::kRiser;
  const Vec3 normal = track.world_T_local.R.col(2);
  if (normal.dot(seen_.plane.normal) < math::cos(upright ? params_.upright_turn_gate_rad : params_.tilt_gate_rad)) {
    return false;
  }
  const Vec3 offset = seen_.centroid_m - track.world_T_local.p_m;
  out.across_m = normal.dot(offset);
  if (std::abs(out.across_m) > (upright ? params_.upright_gate_m : params_.height_gate_max_m)) return false;
  out.variance_m2 =
      seen_.offset_variance_m2 + 1.0 / track.offset_information + offset.squaredNorm() / track.tilt_information;
  out.gate_m = upright ? params_.upright_gate_m
                       : math::clamp(3.0 * math::sqrt(out.variance_m2 + seen_.pose_variance_m2),
                                     params_.height_gate_min_m, params_.height_gate_max_m);
  return std::abs(out.across_m) <= out.gate_m;
}

bool PolygonMap::matches(const MapTrack& track, const Nearness& near, double& cost) const noexcept {
  const bool upright = track.kind == SurfaceKind::kRiser;
  const BoundingBox seen = bounding_box(local_polygon(track)), known = bounding_box(track.polygon);
  const Interval seen_x{seen.min_m.x(), seen.max_m.x()}, known_x{known.min_m.x(), known.max_m.x()};
  const Interval seen_y{seen.min_m.y(), seen.max_m.y()}, known_y{known.min_m.y(), known.max_m.y()};
  const double overlap_x_m = overlap_m(seen_x, known_x), overlap_y_m = overlap_m(seen_y, known_y);
  if (track.kind == SurfaceKind::kOther) {
    if (std::min(overlap_x_m, overlap_y_m) < -params_.other_gap_m) return false;
  } else {
    const double shorter_m =
        upright ? std::min(length_m(seen_y), length_m(known_y)) : std::min(length_m(seen_x), length_m(known_x));
    if ((upright ? overlap_y_m : overlap_x_m) < params_.overlap_fraction * shorter_m) return false;
    if ((upright ? overlap_x_m : overlap_y_m) < -params_.lateral_gap_m) return false;
  }
  cost = std::abs(near.across_m) / near.gate_m + (std::min(overlap_x_m, overlap_y_m) > 0.0 ? 0.0 : 1.0);
  return true;
}

std::int32_t PolygonMap::compare_some() noexcept {
  std::int32_t units = 1;
  for (std::size_t glances = 0; glances < kGlancesPerUnit && track_ < tracks_.size(); ++glances, ++track_) {
    Nearness near;
    if (!is_near(tracks_[track_], near)) continue;
    units += kMatchUnits;
    double cost = 0.0;
    if (!matches(tracks_[track_], near, cost)) continue;
    if (cost < best_cost_) {
      second_ = best_;
      second_cost_ = best_cost_;
      best_ = track_;
      best_cost_ = cost;
    } else if (cost < second_cost_) {
      second_ = track_;
      second_cost_ = cost;
    }
  }
  return units;
}

// What the seen surface says about the frame's offset: along the remembered normal, and across the edges of a tread.
void PolygonMap::measure_offset() noexcept {
  if (best_ >= tracks_.size()) return;
  const MapTrack& track = tracks_[best_];
  Nearness near;
  if (track.sightings < params_.confirmed_sightings || !is_near(track, near)) return;
  const double common_m2 = math::square(params_.systematic_sigma_m);
  // A riser is matched from further off than it may lie; a plane's normal says nothing about its place beside it.
  if (std::abs(near.across_m) < params_.line_gate_max_m) {
    drift_.add(track.world_T_local.R.col(2), near.across_m, near.variance_m2 + common_m2);
  }
  for (const auto& [edge, line] : {std::pair{&seen_.nosing, &track.nosing}, std::pair{&seen_.back, &track.back}}) {
    const std::optional<SeenLine> seen = local_line(track, *edge);
    if (!seen || line->sightings < params_.line_min_sightings || !agrees(*line, *seen)) continue;
    const Vec2 middle_m = 0.5 * (seen->a_m + seen->b_m);
    const double norm = math::sqrt(1.0 + math::square(line->state[1]));
    drift_.add(track.world_T_local.R * Vec3{1.0 / norm, -line->state[1] / norm, 0.0},
               (middle_m.x() - line->at_m(middle_m.y())) / norm,
               seen->variance_m2 + std::min(line->variance_m2(middle_m.y()), 1.0) + common_m2);
  }
  if (track.kind != SurfaceKind::kTread) return;
  const ConvexPolygon seen = local_polygon(track);
  for (const std::size_t k : {kLeftSide, kRightSide}) {
    const TrackedSide& side = track.sides[k];
    const Vec2 u = unit_at(turned(k));
    const double support = support_m(seen, u);
    if (!side.observed || std::abs(support - side.support_m) > params_.side_gate_m) continue;
    if (!end_observed(seen, seen_.edges, u, support)) continue;
    drift_.add(track.world_T_local.R * Vec3{u.x(), u.y(), 0.0}, support - side.support_m,
               math::square(params_.side_sigma_m) + 1.0 / side.information + common_m2);
  }
}

void PolygonMap::fuse_best() noexcept {
  ++fused_in_frame_;
  if (best_ >= tracks_.size()) {
    create();
    return;
  }
  MapTrack& best = tracks_[best_];
  // One surface that lies on two remembered ones says that they are one.
  if (second_ < tracks_.size()) {
    MapTrack& second = tracks_[second_];
    if (best_cost_ < 1.0 && second_cost_ < 1.0) {
      const bool best_stays =
          best.sightings > second.sightings || (best.sightings == second.sightings && best.id < second.id);
      MapTrack& keep = best_stays ? best : second;
      merge(keep, best_stays ? second : best);
      fuse(keep);
      ++counters_.fused;
      return;
    }
  }
  fuse(best);
  ++counters_.fused;
}

double PolygonMap::faded(std::int64_t since_ns) const noexcept {
  return math::exp(-seconds(newest_ns_ - since_ns) / params_.window_s);
}

std::optional<Vec3> PolygonMap::heading_from_lines() const noexcept {
  for (const EdgeLine* line : {&seen_.nosing, &seen_.back}) {
    if (!line->valid) continue;
    const Vec3 along = line->b_m - line->a_m;
    if (along.squaredNorm() < math::square(params_.line_min_length_m)) continue;
    const Vec3 heading = along.cross(seen_.plane.normal).normalized();
    // From the nosing into the surface, out of it over the back edge.
    const double into = heading.dot(seen_.centroid_m - line->a_m) * (line == &seen_.nosing ? 1.0 : -1.0);
    return into >= 0.0 ? heading : Vec3{-heading};
  }
  return std::nullopt;
}

void PolygonMap::create() noexcept {
  MapTrack track;
  track.id = next_id_++;
  track.kind = seen_.kind;
  track.sightings = 1;
  track.first_seen_ns = track.last_seen_ns = newest_ns_;
  const Vec3 normal = seen_.plane.normal;
  const Vec3 level = Vec3::UnitZ().cross(normal);  // horizontal; x of an upright surface, so that y is up
  // Optical axis and the picture's up together point ahead at any camera pitch.
  const Vec3 ahead = map_T_camera_.R.col(2) - map_T_camera_.R.col(1);
  Vec3 x_hint = track.kind == SurfaceKind::kTread ? ahead : level;
  if (track.kind == SurfaceKind::kTread) {
    if (const std::optional<Vec3> heading = heading_from_lines()) x_hint = *heading;
  }
  track.world_T_local = {frame_from(normal, x_hint), seen_.centroid_m};
  track.offset_information = 1.0 / seen_.offset_variance_m2;
  track.tilt_information = 1.0 / seen_.tilt_variance_rad2;
  track.rmse_m = seen_.rmse_m;
  track.invalid_fraction = seen_.invalid_fraction;
  seen_local_ = local_polygon(track);
  if (const auto line = local_line(track, seen_.nosing)) update_line(track.nosing, *line);
  if (const auto line = local_line(track, seen_.back)) update_line(track.back, *line);
  update_sides(track, true);
  rebuild(track);
  if (track.polygon.size() < 3) {
    ++counters_.rejected_surfaces;
    return;
  }
  const bool worth_a_place =
      track.kind != SurfaceKind::kOther || (area_m2(track.polygon) >= params_.other_area_min_m2 && claim(track) > 0);
  if (!worth_a_place) {
    ++counters_.passed_over;
    return;
  }
  admit(track);
}

// What is worth keeping when the map is full.
int PolygonMap::claim(const MapTrack& track) const noexcept {
  const Vec2 eye_m = local_xy(track.world_T_local, map_T_camera_.p_m);
  // A long floor's middle may be far from where the robot stands on it.
  const double distance_m = track.kind == SurfaceKind::kTread
                                ? -signed_distance_m(track.polygon, eye_m)
                                : (track.world_T_local.p_m - map_T_camera_.p_m).head<2>().norm();
  if (track.dead || distance_m > params_.reach_m) return 0;
  return (track.kind == SurfaceKind::kOther ? 1 : 3) + (track.sightings < params_.confirmed_sightings ? 0 : 1);
}

void PolygonMap::admit(const MapTrack& track) noexcept {
  if (!tracks_.try_push_back(track)) {
    // The least worth keeping goes, of these the one not seen for longest.
    std::size_t victim = 0;
    int least = claim(tracks_[0]);
    for (std::size_t i = 1; i < tracks_.size(); ++i) {
      const int worth = claim(tracks_[i]);
      if (worth < least || (worth == least && tracks_[i].last_seen_ns < tracks_[victim].last_seen_ns)) {
        victim = i;
        least = worth;
      }
    }
    // Never for something of less worth, nor one surface of this frame for its like.
    const int claimed = claim(track);
    if (least > claimed || (least == claimed && tracks_[victim].last_seen_ns == newest_ns_)) {
      ++counters_.refused;
      return;
    }
    ++(least > 0 ? counters_.evicted : counters_.forgotten);
    tracks_[victim] = track;
  }
  ++counters_.created;
}

void PolygonMap::fuse(MapTrack& track) noexcept {
  double fade = faded(track.last_seen_ns);
  if (track.last_seen_ns != newest_ns_) ++track.sightings;
  track.last_seen_ns = newest_ns_;
  track.misses = 0;
  track.rmse_m += 0.1 * (seen_.rmse_m - track.rmse_m);
  track.invalid_fraction = seen_.invalid_fraction;

  // The plane: offset along the normal at the local origin, and tilt about it.
  Transform& frame = track.world_T_local;
  Vec3 normal = frame.R.col(2);
  const double cosine = normal.dot(seen_.plane.normal);
  const double offset_m = -seen_.plane.distance_m(frame.p_m) / cosine;
  // A riser is matched from further off than it may have moved.
  if (std::abs(offset_m) > params_.line_gate_max_m) {
    ++counters_.plane_outliers;
    if (++track.outliers < params_.outliers_to_reset) return;
    ++counters_.resets;
    fade = 0.0;
  }
  track.outliers = 0;
  const double lever2_m2 = (seen_.centroid_m - frame.p_m).squaredNorm();
  const double weight = 1.0 / (seen_.offset_variance_m2 + seen_.tilt_variance_rad2 * lever2_m2);
  track.offset_information = track.offset_information * fade + weight;
  frame.p_m += (weight / track.offset_information) * offset_m * normal;
  track.tilt_information = track.tilt_information * fade + 1.0 / seen_.tilt_variance_rad2;
  const double tilt_gain = 1.0 / (seen_.tilt_variance_rad2 * track.tilt_information);
  normal = (normal + tilt_gain * (seen_.plane.normal - cosine * normal)).normalized();
  frame.R = frame_from(normal, frame.R.col(0));

  if (track.kind == SurfaceKind::kTread) {
    if (track.nosing.sightings == 0 && track.back.sightings == 0) {
      if (const std::optional<Vec3> heading = heading_from_lines()) turn_to(track, *heading);
    }
    if (const auto line = local_line(track, seen_.nosing)) update_line(track.nosing, *line);
    if (const auto line = local_line(track, seen_.back)) update_line(track.back, *line);
    const TrackedLine& reference = track.nosing.sightings >= params_.line_min_sightings ? track.nosing : track.back;
    if (reference.sightings >= params_.line_min_sightings && std::abs(reference.state[1]) > kMaxLocalSlope) {
      turn_to(track, frame.R * Vec3{1.0, -reference.state[1], 0.0});
    }
  }
  seen_local_ = local_polygon(track);
  update_sides(track, false);
  rebuild(track);
}

void PolygonMap::merge(MapTrack& into, MapTrack& from) noexcept {
  // The other one is one more sighting of where the surface reaches.
  const Transform into_T_from = into.world_T_local.inverse() * from.world_T_local;
  for (std::size_t k = 0; k < kMapSides; ++k) {
    const Vec2 u = unit_at(turned(k));
    for (const Vec2& v : from.polygon) {
      const double reach_m = u.dot((into_T_from * Vec3{v.x(), v.y(), 0.0}).head<2>());
      if (!into.sides[k].observed) into.sides[k].support_m = std::max(into.sides[k].support_m, reach_m);
    }
  }
  into.sightings = std::max(into.sightings, from.sightings);
  into.first_seen_ns = std::min(into.first_seen_ns, from.first_seen_ns);
  from.dead = true;
  ++counters_.merged;
}

std::optional<SeenLine> PolygonMap::local_line(const MapTrack& track, const EdgeLine& line) const noexcept {
  if (!line.valid || track.kind != SurfaceKind::kTread) return std::nullopt;
  const SeenLine seen{local_xy(track.world_T_local, line.a_m), local_xy(track.world_T_local, line.b_m),
                      math::square(std::max(line.sigma_m, kMinSigma_m))};
  const Vec2 along = seen.b_m - seen.a_m;
  // More than 45 degrees off is no edge across the stairs.
  if (std::abs(along.y()) < params_.line_min_length_m || std::abs(along.x()) > std::abs(along.y())) return std::nullopt;
  return seen;
}

void PolygonMap::turn_to(MapTrack& track, const Vec3& world_x) noexcept {
  Transform& frame = track.world_T_local;
  const Transform turned_frame{frame_from(frame.R.col(2), world_x), frame.p_m};
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
    track.sides[k].support_m = track.sides[k].reach_m = support_m(track.polygon, unit_at(turned(k)));
  }
  for (TrackedLine* line : {&track.nosing, &track.back}) {
    const Vec2 a = new_R_old * Vec2{line->at_m(-0.5), -0.5}, b = new_R_old * Vec2{line->at_m(0.5), 0.5};
    const Vec2 along = b - a;
    if (!(along.y() > 0.5)) {  // turned by over 60 degrees: it was no edge across the stairs
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
  const double gate = math::clamp(4.0 * sigma, params_.line_gate_min_m, params_.line_gate_max_m);
  const double turn_gate = std::max(params_.line_turn_gate, 4.0 * math::sqrt(seen.variance_m2) / half_m);
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
  ++line.sightings;
}

void PolygonMap::update_sides(MapTrack& track, bool first) noexcept {
  for (std::size_t k = 0; k < kMapSides; ++k) {
    const Vec2 u = unit_at(turned(k));
    const double support = support_m(seen_local_, u);
    const bool observed = end_observed(seen_local_, seen_.edges, u, support);
    TrackedSide& side = track.sides[k];
    if (first) {
      const double reach_m = support - params_.unknown_margin_m;
      side = {observed ? support : reach_m, reach_m, 1.0 / math::square(params_.side_sigma_m), newest_ns_, 0, observed};
    } else {
      update_side(side, support, observed);
    }
  }
}

void PolygonMap::update_side(TrackedSide& side, double seen_m, bool observed) noexcept {
  const double weight = 1.0 / math::square(params_.side_sigma_m);
  // Certainly surface up to here, in this frame and in the one before.
  const double seen_reach_m = seen_m - params_.unknown_margin_m;
  const double reach_m = std::min(seen_reach_m, std::exchange(side.reach_m, seen_reach_m));
  if (!observed && !side.observed) {
    side.support_m = std::max(side.support_m, reach_m);
    return;
  }
  if (!observed && reach_m < side.support_m + params_.side_gate_m) return;  // nothing new
  const bool agrees = observed && std::abs(seen_m - side.support_m) < params_.side_gate_m;
  if (agrees && side.observed) {
    side.information = side.information * faded(side.seen_ns) + weight;
    side.support_m += weight / side.information * (seen_m - side.support_m);
    side.seen_ns = newest_ns_;
    side.outliers = 0;
    return;
  }
  // The first observed end that does not cut off what was seen counts at once; contradictions must persist.
  const bool extends = observed && !side.observed && seen_m > side.support_m - params_.side_gate_m;
  if (!extends) {
    ++counters_.side_outliers;
    if (++side.outliers < params_.outliers_to_reset) return;
    ++counters_.resets;
  }
  side = {observed ? seen_m : reach_m, seen_reach_m, weight, newest_ns_, 0, observed};
}

void PolygonMap::rebuild(MapTrack& track) noexcept {
  const std::array<TrackedSide, kMapSides>& s = track.sides;
  const bool has_nosing = track.nosing.sightings >= params_.line_min_sightings;
  const bool has_back = track.back.sightings >= params_.line_min_sightings;
  const auto build = [&](bool use_nosing, bool use_back, EdgeTags& tags) {
    // Where a line decides, the box gives way to it at both ends.
    double x_min = -s[4].support_m, x_max = s[0].support_m;
    const double y_min = -s[6].support_m, y_max = s[2].support_m;
    if (use_nosing) x_min = std::min(track.nosing.at_m(y_min), track.nosing.at_m(y_max)) - 0.01;
    if (use_back) x_max = std::max(track.back.at_m(y_min), track.back.at_m(y_max)) + 0.01;
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
      polygon = clip(polygon, {-unit_at(turned(k)), -s[k].support_m}, &tags, static_cast<std::uint8_t>(k));
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
  }
  if (area_m2(polygon) < kMinArea_m2) return;  // ends that cross: the old polygon stays
  track.polygon = polygon;
  track.tags = tags;
}

bool PolygonMap::should_be_seen(const MapTrack& track) const noexcept {
  const Transform camera_T_local = map_T_camera_.inverse() * track.world_T_local;
  const Vec2 middle = centroid_m(track.polygon);
  const Vec3 centre = camera_T_local * Vec3{middle.x(), middle.y(), 0.0};
  const double range_m = centre.norm();
  const double incidence = -camera_T_local.R.col(2).dot(centre) / std::max(range_m, 1e-6);
  if (range_m > params_.view_range_m || incidence < params_.view_min_incidence) return false;
  const CameraIntrinsics& c = view_.intrinsics;
  for (const Vec2& v : track.polygon) {
    const Vec2 inner = 0.5 * (v + middle);
    const Vec3 p = camera_T_local * Vec3{inner.x(), inner.y(), 0.0};
    if (p.z() < 0.1) return false;
    const double u_px = c.cx_px + c.fx_px * p.x() / p.z(), v_px = c.cy_px + c.fy_px * p.y() / p.z();
    if (u_px < params_.view_margin_px || u_px > c.width_px - params_.view_margin_px) return false;
    if (v_px < params_.view_margin_px || v_px > c.height_px - params_.view_margin_px) return false;
  }
  return true;
}

void PolygonMap::age(MapTrack& track) noexcept {
  if (track.dead || track.last_seen_ns == newest_ns_) return;
  const bool confirmed = track.sightings >= params_.confirmed_sightings;
  if (should_be_seen(track)) ++track.misses;
  if (confirmed && track.misses >= params_.misses_confirmed) {
    track.dead = true;
    ++counters_.dropped_vanished;
  } else if (!confirmed && (track.misses >= params_.misses_unconfirmed ||
                            seconds(newest_ns_ - track.last_seen_ns) > params_.unconfirmed_age_s)) {
    track.dead = true;
    ++counters_.dropped_unconfirmed;
  }
}

std::int32_t PolygonMap::publish() noexcept {
  MapPolygons& out = snapshot_.polygons;
  auto units = static_cast<std::int32_t>(1 + tracks_.size() / kGlancesPerUnit);
  (void)out.try_resize(tracks_.size());
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (tracks_[i].dirty) {
      write(tracks_[i], out[i]);
      ++units;
    }
    tracks_[i].dirty = false;
    write_sigmas(tracks_[i], out[i].surface);
  }
  for (std::size_t i = tracks_.size(); i-- > 0;) {
    if (!tracks_[i].dead) continue;
    (void)tracks_.try_swap_remove(i);
    (void)out.try_swap_remove(i);
  }
  ++counters_.frames;
  snapshot_.drift_m = drift_.drift_m();
  if (fused_in_frame_ > 0) snapshot_.stamp_ns = newest_ns_;
  return units;
}

void PolygonMap::write(const MapTrack& track, MapPolygon& out) const noexcept {
  const Transform& frame = track.world_T_local;
  const auto world = [&frame](const Vec2& p) { return Vec3{frame * Vec3{p.x(), p.y(), 0.0}}; };
  SurfacePatch& surface = out.surface;
  surface.kind = track.kind;
  surface.normal = frame.R.col(2);
  surface.d_m = -surface.normal.dot(frame.p_m);
  surface.centroid_m = world(centroid_m(track.polygon));
  surface.area_m2 = area_m2(track.polygon);
  surface.rmse_m = track.rmse_m;
  surface.invalid_fraction = track.invalid_fraction;
  surface.polygon.clear();
  surface.nosing = {};
  surface.back = {};
  const std::size_t n = track.polygon.size();
  for (std::size_t i = 0; i < n && i < kMaxPolygonVertices; ++i) {
    const std::uint8_t tag = track.tags[i];
    (void)surface.polygon.try_push_back(world(track.polygon[i]));
    surface.edges[i] = tag >= kNosingTag || track.sides[tag].observed ? EdgeKind::kObserved : EdgeKind::kUnknown;
    if (tag < kNosingTag) continue;
    // Left end first, looking up the stairs; the polygon runs counter-clockwise.
    EdgeLine& line = tag == kNosingTag ? surface.nosing : surface.back;
    const Vec3 from = world(track.polygon[i]), to = world(track.polygon[i + 1 == n ? 0 : i + 1]);
    line.a_m = tag == kNosingTag ? from : to;
    line.b_m = tag == kNosingTag ? to : from;
    line.valid = true;
  }
  out.id = track.id;
  out.sightings = track.sightings;
  out.first_seen_ns = track.first_seen_ns;
  out.last_seen_ns = track.last_seen_ns;
}

// Against the robot, which stands where its map has it: the error of the pose is theirs in common.
void PolygonMap::write_sigmas(const MapTrack& track, SurfacePatch& out) const noexcept {
  const double common = math::square(params_.systematic_sigma_m);
  const auto sigma = [&](double variance, std::int64_t seen_ns) {
    return math::sqrt(variance + common + math::square(params_.drift_m_per_sqrt_s) * seconds(newest_ns_ - seen_ns));
  };
  out.offset_sigma_m = sigma(1.0 / track.offset_information, track.last_seen_ns);
  out.tilt_sigma_rad = math::sqrt(1.0 / track.tilt_information + math::square(view_.tilt_sigma_rad));
  for (const auto& [line, edge] : {std::pair{&track.nosing, &out.nosing}, std::pair{&track.back, &out.back}}) {
    if (!edge->valid) continue;
    const double y_m = local_xy(track.world_T_local, 0.5 * (edge->a_m + edge->b_m)).y();
    edge->sigma_m = sigma(std::min(line->variance_m2(y_m), 1.0), line->seen_ns);
  }
}

}  // namespace polygmap
