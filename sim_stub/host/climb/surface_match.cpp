// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/surface_match.hpp"

#include <cmath>
#include <span>
#include <vector>

namespace polygmap::sim {
namespace {

// An axis-aligned rectangle in the true world: flat along `axis`, facing `sign` along it. Its place on the axis may be
// a range: a riser under a nosing shows two planes.
struct TrueSurface {
  int axis;
  double sign;
  Vec3 low_m;
  Vec3 high_m;
};

std::vector<TrueSurface> stair_surfaces(const StairWorld& world) {
  const double w = world.half_width_m;
  std::vector<TrueSurface> all;
  double below_m = 0.0;
  for (const Step& s : world.steps) {
    all.push_back({2, 1.0, {s.nosing_x_m, -w, s.height_m}, {s.back_x_m, w, s.height_m}});
    all.push_back({0, -1.0, {s.nosing_x_m, -w, below_m}, {s.riser_x_m, w, s.height_m}});
    all.push_back({1, 1.0, {s.riser_x_m, w, 0.0}, {s.back_x_m, w, s.height_m}});
    all.push_back({1, -1.0, {s.riser_x_m, -w, 0.0}, {s.back_x_m, -w, s.height_m}});
    below_m = s.height_m;
  }
  for (const Obstacle& o : world.obstacles) {
    for (const int axis : {0, 1, 2}) {
      for (const double sign : {1.0, -1.0}) {
        TrueSurface face{axis, sign, o.centre_m - 0.5 * o.size_m, o.centre_m + 0.5 * o.size_m};
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

// Seen on both sides of the staircase the floor is one surface, and its convex polygon runs beneath the steps.
bool is_on_floor(const StairWorld& world, const Vec3& normal, std::span<const Vec3> polygon_m,
                 const SurfaceMatchLimits& limits) {
  if (!(normal.z() >= std::cos(limits.angle_rad))) return false;
  bool any_beside_the_stairs = world.steps.empty();
  for (const Vec3& vertex_m : polygon_m) {
    if (!(std::abs(vertex_m.z()) <= limits.distance_m)) return false;
    any_beside_the_stairs = any_beside_the_stairs || std::abs(vertex_m.y()) > world.half_width_m ||
                            vertex_m.x() < world.steps.front().riser_x_m || vertex_m.x() > world.steps.back().back_x_m;
  }
  return any_beside_the_stairs;
}

}  // namespace

bool matches_true_surface(const StairWorld& world, const SurfacePatch& patch, const Transform& true_T_camera,
                          const SurfaceMatchLimits& limits) {
  if (patch.polygon.size() < 3) return false;
  const Vec3 normal = true_T_camera.R * patch.normal;
  const Vec3 centroid_m = true_T_camera * patch.centroid_m;
  std::vector<Vec3> polygon_m;
  for (const Vec3& vertex_m : patch.polygon) polygon_m.push_back(true_T_camera * vertex_m);
  if (is_on_floor(world, normal, polygon_m, limits)) return true;
  for (const TrueSurface& surface : stair_surfaces(world)) {
    if (is_on(surface, normal, centroid_m, polygon_m, limits)) return true;
  }
  return false;
}

}  // namespace polygmap::sim
