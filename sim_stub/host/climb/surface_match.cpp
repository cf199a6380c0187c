// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/surface_match.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "algorithms/geometry/convex.hpp"

namespace polygmap::sim {
namespace {

constexpr double kOnSurface_m = 0.001;  // what is rendered lies on its surface but for single precision
constexpr int kCoarse_px = 4;           // one ray stands for as many columns and rows

// Floor 0; of step k (0-based) tread 1 + 2 k and riser 2 + 2 k; then the left side, the right side.
constexpr int kFloorSurface = 0;
// Of all faces of all obstacles: they may be seen, and need not be.
constexpr int kObstacleSurface = -2;

std::vector<TrueSurface> stair_surfaces(const StairWorld& world) {
  const double w = world.half_width_m;
  std::vector<TrueSurface> all;
  double below_m = 0.0;
  const int left = 1 + 2 * static_cast<int>(world.steps.size());
  int id = kFloorSurface;
  for (int k = 0; k < static_cast<int>(world.steps.size()); ++k) {
    const Step& s = world.steps[static_cast<std::size_t>(k)];
    const double back_m = s.back_x_m + s.beneath_m;
    all.push_back({++id, 2, 1.0, {s.nosing_x_m, -w, s.height_m}, {back_m, w, s.height_m}, k});
    all.push_back({++id, 0, -1.0, {s.nosing_x_m, -w, below_m}, {s.riser_x_m, w, s.height_m}, k});
    all.push_back({left, 1, 1.0, {s.riser_x_m, w, 0.0}, {back_m, w, s.height_m}, k});
    all.push_back({left + 1, 1, -1.0, {s.riser_x_m, -w, 0.0}, {back_m, -w, s.height_m}, k});
    below_m = s.height_m;
  }
  for (const Obstacle& o : world.obstacles) {
    for (const int axis : {0, 1, 2}) {
      for (const double sign : {1.0, -1.0}) {
        TrueSurface face{kObstacleSurface, axis, sign, o.centre_m - 0.5 * o.size_m, o.centre_m + 0.5 * o.size_m};
        (sign > 0.0 ? face.low_m : face.high_m)[axis] = (sign > 0.0 ? face.high_m : face.low_m)[axis];
        all.push_back(face);
      }
    }
  }
  return all;
}

bool is_on(const TrueSurface& surface, const Vec3& normal, const Vec3& centroid_m, std::span<const Vec3> polygon_m,
           const SurfaceMatchLimits& limits) {
  if (!(surface.sign * normal[surface.axis] >= std::cos(limits.angle_rad))) return false;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == surface.axis) continue;
    if (!(centroid_m[axis] >= surface.low_m[axis] - limits.overhang_m)) return false;
    if (!(centroid_m[axis] <= surface.high_m[axis] + limits.overhang_m)) return false;
  }
  for (const Vec3& vertex_m : polygon_m) {
    if (!(vertex_m[surface.axis] >= surface.low_m[surface.axis] - limits.distance_m)) return false;
    if (!(vertex_m[surface.axis] <= surface.high_m[surface.axis] + limits.distance_m)) return false;
  }
  return true;
}

// On the floor, and not beneath the steps: a polygon that runs through there covers what it has not seen.
bool is_on_floor(const StairWorld& world, const Vec3& normal, std::span<const Vec3> polygon_m,
                 const SurfaceMatchLimits& limits) {
  if (!(normal.z() >= std::cos(limits.angle_rad))) return false;
  ConvexPolygon plan;
  for (const Vec3& vertex_m : polygon_m) {
    if (!(std::abs(vertex_m.z()) <= limits.distance_m)) return false;
    static_cast<void>(plan.try_push_back(vertex_m.head<2>()));
  }
  if (world.steps.empty()) return true;
  const double first_m = world.steps.front().riser_x_m + limits.overhang_m;
  const double last_m = world.steps.back().back_x_m - limits.overhang_m;
  const double half_m = world.half_width_m - limits.overhang_m;
  ConvexPolygon steps;
  for (const Vec2& corner_m :
       {Vec2{first_m, -half_m}, Vec2{last_m, -half_m}, Vec2{last_m, half_m}, Vec2{first_m, half_m}}) {
    static_cast<void>(steps.try_push_back(corner_m));
  }
  constexpr double kTouched_m2 = 1e-3;
  return area_m2(intersection(convex_hull(plan), steps)) < kTouched_m2;
}

}  // namespace

int matching_surface(const StairWorld& world, const SurfacePatch& patch, const Transform& true_T_camera,
                     const SurfaceMatchLimits& limits) {
  if (patch.polygon.size() < 3) return kNoSurface;
  const Vec3 normal = true_T_camera.R * patch.normal;
  const Vec3 centroid_m = true_T_camera * patch.centroid_m;
  std::vector<Vec3> polygon_m;
  for (const Vec3& vertex_m : patch.polygon) polygon_m.push_back(true_T_camera * vertex_m);
  if (is_on_floor(world, normal, polygon_m, limits)) return kFloorSurface;
  for (const TrueSurface& surface : stair_surfaces(world)) {
    if (surface.step < 0) {
      if (is_on(surface, normal, centroid_m, polygon_m, limits)) return surface.id;
      continue;
    }
    const Transform step_T_true = world.steps[static_cast<std::size_t>(surface.step)].true_T_step.inverse();
    std::vector<Vec3> along_m;
    for (const Vec3& vertex_m : polygon_m) along_m.push_back(step_T_true * vertex_m);
    if (is_on(surface, step_T_true.R * normal, step_T_true * centroid_m, along_m, limits)) return surface.id;
  }
  return kNoSurface;
}

SurfaceVisibility::SurfaceVisibility(const StairWorld& world, const CameraIntrinsics& intrinsics)
    : solids_(stair_solids(world)), surfaces_(stair_surfaces(world)), seen_(3 + 2 * world.steps.size()), renderer_([&] {
        CameraIntrinsics coarse = intrinsics;
        coarse.width_px /= kCoarse_px, coarse.height_px /= kCoarse_px;
        coarse.fx_px /= kCoarse_px, coarse.fy_px /= kCoarse_px;
        coarse.cx_px = (coarse.cx_px + 0.5) / kCoarse_px - 0.5, coarse.cy_px = (coarse.cy_px + 0.5) / kCoarse_px - 0.5;
        return coarse;
      }()) {
  for (const Step& step : world.steps) step_T_true_.push_back(step.true_T_step.inverse());
}

const std::vector<int>& SurfaceVisibility::in_view(const Transform& true_T_camera, const Transform& base_T_camera,
                                                   const std::array<LegShapes, kFootCount>& base_legs,
                                                   const InViewLimits& limits) {
  DepthScene scene{true_T_camera, solids_, base_legs, base_T_camera, true};
  for (LegShapes& leg : scene.base_legs) {  // what is masked around the legs is not in view either
    if (leg.thigh.radius_m > 0.0) leg.thigh.radius_m += limits.body_margin_m;
    if (leg.shank.radius_m > 0.0) leg.shank.radius_m += limits.body_margin_m;
    if (leg.foot.half_m.norm() > 0.0) leg.foot.half_m.array() += limits.body_margin_m;
  }
  renderer_.render(scene);
  std::fill(seen_.begin(), seen_.end(), SeenSurface{});
  const CameraIntrinsics& k = renderer_.intrinsics();
  for (int v = 0; v < k.height_px; ++v) {
    for (int u = 0; u < k.width_px; ++u) {
      const auto w = static_cast<double>(renderer_.inverse_depth(v)[u]);
      const double cosine = w * static_cast<double>(renderer_.plane_distance(v)[u] * renderer_.inverse_length(v)[u]);
      if (!(w * limits.range_m > 1.0) || cosine < std::cos(limits.grazing_rad)) continue;
      const Vec3 ray{(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, 1.0};
      see(true_T_camera * Vec3(ray / w), kCoarse_px * kCoarse_px);
    }
  }
  in_view_.clear();
  for (std::size_t id = 0; id < seen_.size(); ++id) {
    if (seen_[id][0].well(limits) || seen_[id][1].well(limits)) in_view_.push_back(static_cast<int>(id));
  }
  return in_view_;
}

void SurfaceVisibility::see(const Vec3& point_m, int px) {
  // The floor first: under a nosing it reaches to the riser.
  int id = std::abs(point_m.z()) <= kOnSurface_m ? kFloorSurface : kNoSurface;
  bool farther = false;
  Vec3 along_m = point_m;  // the axes of along_step
  int along_step = kFloorStep;
  for (std::size_t i = 0; i < surfaces_.size() && id == kNoSurface; ++i) {
    const TrueSurface& s = surfaces_[i];
    if (s.step != along_step) {
      along_step = s.step;
      along_m = s.step < 0 ? point_m : step_T_true_[static_cast<std::size_t>(s.step)] * point_m;
    }
    if (((along_m - s.low_m).array() < -kOnSurface_m).any() || ((s.high_m - along_m).array() < -kOnSurface_m).any()) {
      continue;
    }
    id = s.id;
    farther = 2.0 * along_m[s.axis] > s.low_m[s.axis] + s.high_m[s.axis];
    if (id < 0) return;  // an obstacle's
  }
  if (id < 0) return;
  Seen& seen = seen_[static_cast<std::size_t>(id)][farther ? 1 : 0];
  seen.px += px;
  seen.low_m = seen.low_m.cwiseMin(along_m);
  seen.high_m = seen.high_m.cwiseMax(along_m);
}

bool SurfaceVisibility::Seen::well(const InViewLimits& limits) const {
  if (px < limits.least_px) return false;
  Vec3 extent_m = high_m - low_m;
  std::sort(extent_m.begin(), extent_m.end());  // the least is across the plane
  return extent_m[1] >= limits.least_extent_m;
}

}  // namespace polygmap::sim
