// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/polygon_map.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace polygmap {
namespace {

constexpr std::size_t kThingsAtOnce = 16;  // in a piece of work

bool valid(const SurfacePatch& patch, double max_range_m) noexcept {
  if (patch.polygon.size() < 3 || !math::all_finite(patch.normal) || !math::all_finite(patch.centroid_m)) return false;
  if (!(std::abs(patch.normal.squaredNorm() - 1.0) < 1e-3) ||
      !(patch.centroid_m.squaredNorm() < math::square(max_range_m))) {
    return false;
  }
  if (!std::isfinite(patch.d_m) || !(patch.offset_sigma_m >= 0.0) || !(patch.offset_sigma_m < 1.0)) return false;
  if (!(patch.tilt_sigma_rad >= 0.0) || !(patch.tilt_sigma_rad < 1.0)) return false;
  for (const Vec3& v : patch.polygon) {
    if (!(v.squaredNorm() < math::square(max_range_m))) return false;
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
  const Mat3& R = view.odom_T_camera.R;
  return math::all_finite(R) && math::all_finite(view.odom_T_camera.p_m) &&
         (R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-6 && view.position_sigma_m >= 0.0 &&
         std::isfinite(view.position_sigma_m) && view.tilt_sigma_rad >= 0.0 && std::isfinite(view.tilt_sigma_rad) &&
         view.mount_sigma_rad >= 0.0 && std::isfinite(view.mount_sigma_rad) && view.intrinsics.fx_px > 0.0 &&
         view.intrinsics.fy_px > 0.0;
}

EdgeLine moved(const Transform& a_T_b, const EdgeLine& line) noexcept {
  EdgeLine out = line;
  out.a_m = a_T_b * line.a_m;
  out.b_m = a_T_b * line.b_m;
  return out;
}

}  // namespace

void PolygonMap::clear() noexcept {
  tracks_.clear();
  snapshot_.polygons.clear();
  snapshot_.stamp_ns = 0;
  snapshot_.drift_m.setZero();
  drift_.clear();
  things_.clear();
  ground_.clear();
  snapshot_.occupied.clear();
  snapshot_.ground = {};
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
  pass_.fused = 0;
  order_surfaces();
  drift_.begin_frame(frame.stamp_ns, view.position_sigma_m);
  map_T_camera_ = view.odom_T_camera;
  map_T_camera_.p_m -= drift_.drift_m();
  pass_.measuring = drift_.possible();
  pass_.patch = 0;
  stage_ = Stage::kLoad;
  if (!pass_.measuring) begin_fusing();
}

// Where the map is nearly full, what a foot needs finds its place first.
void PolygonMap::order_surfaces() noexcept {
  order_.clear();
  for (const bool others : {false, true}) {
    for (std::size_t i = 0; i < frame_.surfaces.size(); ++i) {
      if ((frame_.surfaces[i].kind == SurfaceKind::kOther) != others) continue;
      (void)order_.try_push_back(static_cast<std::uint8_t>(i));
    }
    if (!others) alignment_count_ = order_.size();
  }
}

void PolygonMap::begin_fusing() noexcept {
  work_.add(600);
  if (pass_.measuring) drift_.end_frame();
  pass_.measuring = false;
  map_T_camera_.p_m = view_.odom_T_camera.p_m - drift_.frame_offset_m();
  pass_.patch = 0;
}

void PolygonMap::next_surface() noexcept {
  pass_.track = 0;
  if (pass_.measuring && pass_.patch >= alignment_count_) return begin_fusing();
  if (pass_.patch >= order_.size()) {
    stage_ = Stage::kAge;
  } else if (load(frame_.surfaces[order_[pass_.patch]])) {
    pass_.best = pass_.second = kMaxMapPolygons;
    pass_.best_cost = pass_.second_cost = std::numeric_limits<double>::infinity();
    stage_ = Stage::kCompare;
  } else {
    if (!pass_.measuring) ++counters_.rejected_surfaces;
    ++pass_.patch;
  }
}

Progress PolygonMap::step(WorkBudget& budget) noexcept {
  if (stage_ == Stage::kIdle) return Progress::kIdle;
  while (!budget.exhausted()) {
    do_piece();
    work_.add(120);
    work_.add(things_.work());
    work_.add(ground_.work());
    budget.spend(work_.take_units());
    if (stage_ == Stage::kIdle) return Progress::kDone;
  }
  return Progress::kBusy;
}

void PolygonMap::do_piece() noexcept {
  switch (stage_) {
    case Stage::kLoad:
      next_surface();
      break;
    case Stage::kCompare:
      compare_some();
      if (pass_.track >= tracks_.size()) stage_ = Stage::kFuse;
      break;
    case Stage::kFuse:
      if (pass_.measuring) {
        measure_offset();
      } else {
        fuse_best();
      }
      ++pass_.patch;
      stage_ = Stage::kLoad;
      break;
    case Stage::kAge:
      if (pass_.track < tracks_.size()) {
        age(tracks_[pass_.track++]);
      } else {
        begin_things();
      }
      break;
    case Stage::kThings:
      if (pass_.thing < frame_.things.size()) {
        things_.add(frame_.things[pass_.thing++]);
      } else {
        pass_.thing = 0;
        stage_ = Stage::kThingsAgain;
      }
      break;
    case Stage::kThingsAgain:
      for (const std::size_t end = std::min(pass_.thing + kThingsAtOnce, things_.count()); pass_.thing < end;)
        things_.look_again(pass_.thing++);
      if (pass_.thing >= things_.count()) begin_ground();
      break;
    case Stage::kGround:
      if (ground_.look()) stage_ = view_.tell_ground ? Stage::kTellGround : Stage::kPublish;
      break;
    case Stage::kTellGround:
      if (!ground_.tell(snapshot_.ground)) break;
      pass_.track = 0;
      stage_ = Stage::kSlopes;
      break;
    case Stage::kSlopes:
      leave_out_slope();
      break;
    case Stage::kPublish:
      publish();
      stage_ = Stage::kIdle;
      break;
    case Stage::kIdle:
      break;
  }
}

void PolygonMap::begin_things() noexcept {
  things_.begin({map_T_camera_, view_.intrinsics, view_.columns});
  pass_.thing = 0;
  stage_ = Stage::kThings;
}

void PolygonMap::begin_ground() noexcept {
  GroundMap::View view{map_T_camera_,     view_.intrinsics, view_.columns, counters_.frames,
                       view_.odom_T_sole, view_.stands,     view_.sole};
  for (Transform& sole : view.map_T_sole) sole.p_m -= view_.odom_T_camera.p_m - map_T_camera_.p_m;
  ground_.begin(view);
  stage_ = Stage::kGround;
}

// The next one, if there is any. What is steeper than a ramp is none that anybody would stand on. Two sightings tell
// it, not as many as a tread needs: waiting for those, soles were set on ramps that were about to be told (2026-12-01).
void PolygonMap::leave_out_slope() noexcept {
  constexpr double kSteepest = 0.7;
  const double level = math::cos(params_.level_rad);
  const auto from = tracks_.begin() + static_cast<std::ptrdiff_t>(pass_.track);
  const auto next = std::find_if(from, tracks_.end(), [&](const MapTrack& track) {
    const double up = track.map_T_local.R(2, 2);
    return up > kSteepest && up < level && track.sightings > 1 && !track.erased;
  });
  work_.add(static_cast<std::size_t>(next - from), 10);
  if (next == tracks_.end()) {
    stage_ = Stage::kPublish;
    return;
  }
  ground_.leave_out(next->map_T_local, next->polygon, snapshot_.ground);
  pass_.track = static_cast<std::size_t>(next - tracks_.begin()) + 1;
}

bool PolygonMap::load(const SurfacePatch& patch) noexcept {
  work_.add(450);
  work_.add(patch.polygon.size(), 60);
  if (!valid(patch, params_.max_range_m)) return false;
  seen_.kind = patch.kind;
  seen_.plane = map_T_camera_ * Plane{patch.normal.normalized(), patch.d_m};
  const double up = seen_.plane.normal.z();
  if (seen_.plane.distance_m(map_T_camera_.p_m) <= 0.0) return false;  // seen from behind
  if (patch.kind == SurfaceKind::kTread && up < params_.kinds.tread_up_min) return false;
  if (patch.kind == SurfaceKind::kRiser && std::abs(up) > params_.kinds.riser_up_max) return false;
  seen_.centroid_m = seen_.plane.project(map_T_camera_ * patch.centroid_m);
  seen_.offset_variance_m2 = math::square(std::max(patch.offset_sigma_m, params_.least_sigma_m));
  seen_.tilt_variance_rad2 = math::square(std::max(patch.tilt_sigma_rad, params_.least_tilt_sigma_rad));
  const double range2_m2 = (seen_.centroid_m - map_T_camera_.p_m).squaredNorm();
  seen_.pose_variance_m2 = math::square(view_.position_sigma_m) +
                           (math::square(view_.tilt_sigma_rad) + math::square(view_.mount_sigma_rad)) * range2_m2;
  seen_.rmse_m = patch.rmse_m;
  seen_.invalid_fraction = patch.invalid_fraction;
  seen_.polygon.clear();
  for (const Vec3& v : patch.polygon) (void)seen_.polygon.try_push_back(seen_.plane.project(map_T_camera_ * v));
  seen_.edges = patch.edges;
  seen_.nosing = moved(map_T_camera_, patch.nosing);
  seen_.back = moved(map_T_camera_, patch.back);
  seen_.back_drops = patch.back_drops;
  return true;
}

}  // namespace polygmap
