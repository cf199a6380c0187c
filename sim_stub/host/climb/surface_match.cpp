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

// Of what the floor's plane cuts, from above: the outline of a box that stands or is sunk in the floor.
ConvexPolygon footprint_of(const SolidBox& solid) {
  constexpr double kJustAbove_m = 0.005;
  const OrientedBox box = solid.box();
  std::array<Vec3, 8> corners_m;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 sign{(i & 1U) != 0U ? 1.0 : -1.0, (i & 2U) != 0U ? 1.0 : -1.0, (i & 4U) != 0U ? 1.0 : -1.0};
    corners_m[i] = box.centre * Vec3(sign.cwiseProduct(box.half_m));
  }
  ConvexPolygon cut;
  for (unsigned i = 0; i < 8; ++i) {
    for (const unsigned axis : {1U, 2U, 4U}) {
      if ((i & axis) != 0U) continue;
      const Vec3 &a_m = corners_m[i], &b_m = corners_m[i | axis];
      const double share = (kJustAbove_m - a_m.z()) / (b_m.z() - a_m.z());
      if (share >= 0.0 && share <= 1.0) static_cast<void>(cut.try_push_back(Vec3(a_m + share * (b_m - a_m)).head<2>()));
    }
  }
  return convex_hull(cut);
}

ConvexPolygon shrunk(const ConvexPolygon& outline, double by_m) {
  ConvexPolygon smaller = outline;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    HalfPlane inside = edge_half_plane(outline, i);
    inside.offset_m += by_m;
    smaller = clip(smaller, inside);
  }
  return smaller;
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

// On the floor, and not beneath what stands there: a polygon that runs through it covers what it has not seen.
bool is_on_floor(const TrueSurfaces& surfaces, const Vec3& normal, std::span<const Vec3> polygon_m,
                 const SurfaceMatchLimits& limits) {
  if (!(normal.z() >= std::cos(limits.angle_rad))) return false;
  ConvexPolygon plan;
  for (const Vec3& vertex_m : polygon_m) {
    if (!(std::abs(vertex_m.z()) <= limits.distance_m)) return false;
    static_cast<void>(plan.try_push_back(vertex_m.head<2>()));
  }
  const ConvexPolygon seen = convex_hull(plan);
  constexpr double kTouched_m2 = 1e-3;
  return std::ranges::all_of(surfaces.footprints, [&](const ConvexPolygon& footprint) {
    return area_m2(intersection(seen, shrunk(footprint, limits.overhang_m))) < kTouched_m2;
  });
}

}  // namespace

TrueSurfaces::TrueSurfaces(const StairWorld& world) {
  const double w = world.half_width_m;
  for (const SolidBox& solid : world.solids) {
    add_faces(all, solid.min_m, solid.max_m, static_cast<int>(axes.size()));
    axes.push_back({solid.true_T_solid.inverse(), solid.min_m, solid.max_m});
    if (ConvexPolygon footprint = footprint_of(solid); footprint.size() > 2) footprints.push_back(footprint);
  }
  if (!world.is_staircase) return;
  any_to_be_found = true;
  double below_m = 0.0;
  const int left = 1 + 2 * static_cast<int>(world.steps.size());
  int id = kFloorSurface;
  for (int k = 0; k < static_cast<int>(world.steps.size()); ++k) {
    const Step& s = world.steps[static_cast<std::size_t>(k)];
    const double back_m = s.back_x_m + s.beneath_m;
    axes.push_back({s.true_T_step.inverse()});
    all.push_back({++id, 2, 1.0, {s.nosing_x_m, -w, s.height_m}, {back_m, w, s.height_m}, k});
    all.push_back({++id, 0, -1.0, {s.nosing_x_m, -w, below_m}, {s.riser_x_m, w, s.height_m}, k});
    all.push_back({left, 1, 1.0, {s.riser_x_m, w, 0.0}, {back_m, w, s.height_m}, k});
    all.push_back({left + 1, 1, -1.0, {s.riser_x_m, -w, 0.0}, {back_m, -w, s.height_m}, k});
    below_m = s.height_m;
  }
  for (const TrueSurface& surface : all) {
    Axes& own = axes[static_cast<std::size_t>(surface.axes)];
    own.low_m = own.low_m.cwiseMin(surface.low_m);
    own.high_m = own.high_m.cwiseMax(surface.high_m);
  }
  for (const Obstacle& o : world.obstacles) {
    add_faces(all, o.centre_m - 0.5 * o.size_m, o.centre_m + 0.5 * o.size_m, -1);
  }
  if (world.steps.empty()) return;
  ConvexPolygon under;
  const Vec2 low_m{world.steps.front().riser_x_m, -w}, high_m{world.steps.back().back_x_m, w};
  for (const Vec2& corner_m : {low_m, Vec2{high_m.x(), low_m.y()}, high_m, Vec2{low_m.x(), high_m.y()}}) {
    static_cast<void>(under.try_push_back(corner_m));
  }
  footprints.push_back(under);
}

int matching_surface(const TrueSurfaces& surfaces, const SurfacePatch& patch, const Transform& true_T_camera,
                     const SurfaceMatchLimits& limits) {
  if (patch.polygon.size() < 3) return kNoSurface;
  const Vec3 normal = true_T_camera.R * patch.normal;
  const Vec3 centroid_m = true_T_camera * patch.centroid_m;
  std::vector<Vec3> polygon_m;
  for (const Vec3& vertex_m : patch.polygon) polygon_m.push_back(true_T_camera * vertex_m);
  if (is_on_floor(surfaces, normal, polygon_m, limits)) return kFloorSurface;
  std::vector<Vec3> own_m;
  Vec3 own_normal = normal, own_centroid_m = centroid_m;
  int along = -2;  // whose axes own_m has
  for (const TrueSurface& surface : surfaces.all) {
    if (surface.axes != along) {
      along = surface.axes;
      const Transform own_T_true = along < 0 ? Transform{} : surfaces.axes[static_cast<std::size_t>(along)].own_T_true;
      own_m.clear();
      for (const Vec3& vertex_m : polygon_m) own_m.push_back(own_T_true * vertex_m);
      own_normal = own_T_true.R * normal;
      own_centroid_m = own_T_true * centroid_m;
    }
    if (is_on(surface, own_normal, own_centroid_m, own_m, limits)) return surface.id;
  }
  return kNoSurface;
}

SurfaceVisibility::SurfaceVisibility(const StairWorld& world, const CameraIntrinsics& intrinsics)
    : solids_(solids_of(world)), surfaces_(world), seen_(3 + 2 * world.steps.size()), renderer_([&] {
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
  if (id == kNoSurface && !surfaces_.any_to_be_found) return;
  bool farther = false;
  Vec3 along_m = point_m;
  int along = -1;       // whose axes
  bool is_near = true;  // what lies along them
  for (std::size_t i = 0; i < surfaces_.all.size() && id == kNoSurface; ++i) {
    const TrueSurface& s = surfaces_.all[i];
    if (s.axes != along) {
      along = s.axes;
      is_near = true;
      along_m = point_m;
      if (along >= 0) {
        const TrueSurfaces::Axes& own = surfaces_.axes[static_cast<std::size_t>(along)];
        along_m = own.own_T_true * point_m;
        is_near = ((along_m - own.low_m).array() >= -kOnSurface_m).all() &&
                  ((own.high_m - along_m).array() >= -kOnSurface_m).all();
      }
    }
    if (!is_near) continue;
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
