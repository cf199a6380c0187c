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
// Of all faces of all obstacles and of a world file's solids: they may be seen, and need not be.
constexpr int kObstacleSurface = -2;

void add_faces(std::vector<TrueSurface>& all, const Vec3& low_m, const Vec3& high_m, int axes) {
  for (const int axis : {0, 1, 2}) {
    for (const double sign : {1.0, -1.0}) {
      TrueSurface face{kObstacleSurface, axis, sign, low_m, high_m, axes};
      (sign > 0.0 ? face.low_m : face.high_m)[axis] = (sign > 0.0 ? face.high_m : face.low_m)[axis];
      all.push_back(face);
    }
  }
}

TrueSurfaces surfaces_of(const StairWorld& world) {
  const double w = world.half_width_m;
  TrueSurfaces out;
  std::vector<TrueSurface>& all = out.all;
  for (const SolidBox& solid : world.solids) {
    add_faces(all, solid.min_m, solid.max_m, static_cast<int>(out.own_T_true.size()));
    out.own_T_true.push_back(solid.true_T_solid.inverse());
  }
  if (!world.is_staircase) return out;
  double below_m = 0.0;
  const int left = 1 + 2 * static_cast<int>(world.steps.size());
  int id = kFloorSurface;
  for (int k = 0; k < static_cast<int>(world.steps.size()); ++k) {
    const Step& s = world.steps[static_cast<std::size_t>(k)];
    const double back_m = s.back_x_m + s.beneath_m;
    out.own_T_true.push_back(s.true_T_step.inverse());
    all.push_back({++id, 2, 1.0, {s.nosing_x_m, -w, s.height_m}, {back_m, w, s.height_m}, k});
    all.push_back({++id, 0, -1.0, {s.nosing_x_m, -w, below_m}, {s.riser_x_m, w, s.height_m}, k});
    all.push_back({left, 1, 1.0, {s.riser_x_m, w, 0.0}, {back_m, w, s.height_m}, k});
    all.push_back({left + 1, 1, -1.0, {s.riser_x_m, -w, 0.0}, {back_m, -w, s.height_m}, k});
    below_m = s.height_m;
  }
  for (const Obstacle& o : world.obstacles)
    add_faces(all, o.centre_m - 0.5 * o.size_m, o.centre_m + 0.5 * o.size_m, -1);
  return out;
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

// The convex hull of what stands on the floor, from above, shrunk: of a staircase one rectangle, else of each solid.
std::vector<ConvexPolygon> footprints(const StairWorld& world, double shrunk_m) {
  std::vector<ConvexPolygon> all;
  const auto add = [&all](const Transform& true_T_own, const Vec2& low_m, const Vec2& high_m, double z_m) {
    ConvexPolygon corners;
    for (const Vec2& corner_m : {low_m, Vec2{high_m.x(), low_m.y()}, high_m, Vec2{low_m.x(), high_m.y()}}) {
      const Vec3 there_m = true_T_own * Vec3(corner_m.x(), corner_m.y(), z_m);
      static_cast<void>(corners.try_push_back(there_m.head<2>()));
    }
    all.push_back(convex_hull(corners));
  };
  const Vec2 in_m = Vec2::Constant(shrunk_m);
  if (world.is_staircase && !world.steps.empty()) {
    const Vec2 low_m{world.steps.front().riser_x_m, -world.half_width_m};
    const Vec2 high_m{world.steps.back().back_x_m, world.half_width_m};
    add({}, low_m + in_m, high_m - in_m, 0.0);
  }
  for (const SolidBox& solid : world.solids) {
    const Vec2 low_m = solid.min_m.head<2>() + in_m, high_m = solid.max_m.head<2>() - in_m;
    const Vec3 bottom_m = solid.true_T_solid * Vec3(0.0, 0.0, solid.min_m.z());
    if (bottom_m.z() <= shrunk_m && (high_m.array() > low_m.array()).all()) {
      add(solid.true_T_solid, low_m, high_m, solid.min_m.z());
    }
  }
  return all;
}

// On the floor, and not beneath what stands there: a polygon that runs through it covers what it has not seen.
bool is_on_floor(const StairWorld& world, const Vec3& normal, std::span<const Vec3> polygon_m,
                 const SurfaceMatchLimits& limits) {
  if (!(normal.z() >= std::cos(limits.angle_rad))) return false;
  ConvexPolygon plan;
  for (const Vec3& vertex_m : polygon_m) {
    if (!(std::abs(vertex_m.z()) <= limits.distance_m)) return false;
    static_cast<void>(plan.try_push_back(vertex_m.head<2>()));
  }
  const ConvexPolygon seen = convex_hull(plan);
  constexpr double kTouched_m2 = 1e-3;
  return std::ranges::all_of(footprints(world, limits.overhang_m), [&](const ConvexPolygon& footprint) {
    return area_m2(intersection(seen, footprint)) < kTouched_m2;
  });
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
  const TrueSurfaces surfaces = surfaces_of(world);
  for (const TrueSurface& surface : surfaces.all) {
    const Transform own_T_true =
        surface.axes < 0 ? Transform{} : surfaces.own_T_true[static_cast<std::size_t>(surface.axes)];
    std::vector<Vec3> own_m;
    for (const Vec3& vertex_m : polygon_m) own_m.push_back(own_T_true * vertex_m);
    if (is_on(surface, own_T_true.R * normal, own_T_true * centroid_m, own_m, limits)) return surface.id;
  }
  return kNoSurface;
}

SurfaceVisibility::SurfaceVisibility(const StairWorld& world, const CameraIntrinsics& intrinsics)
    : solids_(solids_of(world)), surfaces_(surfaces_of(world)), seen_(3 + 2 * world.steps.size()), renderer_([&] {
        CameraIntrinsics coarse = intrinsics;
        coarse.width_px /= kCoarse_px, coarse.height_px /= kCoarse_px;
        coarse.fx_px /= kCoarse_px, coarse.fy_px /= kCoarse_px;
        coarse.cx_px = (coarse.cx_px + 0.5) / kCoarse_px - 0.5, coarse.cy_px = (coarse.cy_px + 0.5) / kCoarse_px - 0.5;
        return coarse;
      }()) {}

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
  Vec3 along_m = point_m;
  int along = -1;  // whose axes
  for (std::size_t i = 0; i < surfaces_.all.size() && id == kNoSurface; ++i) {
    const TrueSurface& s = surfaces_.all[i];
    if (s.axes != along) {
      along = s.axes;
      along_m = along < 0 ? point_m : surfaces_.own_T_true[static_cast<std::size_t>(along)] * point_m;
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
