// SPDX-License-Identifier: Apache-2.0
// Is a surface that perception reports one that truly exists, and does it report those that are well in view?
#pragma once

#include <array>
#include <vector>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/geometry/convex.hpp"
#include "sim_stub/camera/depth_renderer.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

// Wide enough for the simulated sensor (noise, 0.3 % scale, 2 mm warp) and the slivers of far risers, far too narrow
// for the robot's own foot (its top stands 70 mm above the sole) or for the plane through a row of nosings (25 deg).
struct SurfaceMatchLimits {
  double angle_rad = 0.1745;  // between the normals
  double distance_m = 0.03;   // of every vertex from the true plane
  double overhang_m = 0.05;   // of the centroid beyond the true surface's edges
};

// A rectangle along its step's or solid's axes: flat along `axis`, facing `sign` along it. Its place on the axis may be
// a range: a riser under a nosing shows two planes. Rectangles of one id are one surface.
struct TrueSurface {
  int id;
  int axis;
  double sign;
  Vec3 low_m;
  Vec3 high_m;
  int axes = -1;  // which of TrueSurfaces::axes; none: the true world's
};
struct TrueSurfaces {
  explicit TrueSurfaces(const StairWorld& world);

  // Axes, and what lies along them of these surfaces.
  struct Axes {
    Transform own_T_true;
    Vec3 low_m = Vec3::Constant(1e9), high_m = Vec3::Constant(-1e9);
  };
  std::vector<TrueSurface> all;
  std::vector<Axes> axes;
  bool any_to_be_found = false;           // beside the floor
  std::vector<ConvexPolygon> footprints;  // of what stands on the floor, from above
};

inline constexpr int kNoSurface = -1;
// Which true surface the patch is: the floor, a tread, a riser, a side of the staircase, or any face of what is none.
// patch in the camera frame, true_T_camera at its exposure.
[[nodiscard]] int matching_surface(const TrueSurfaces& surfaces, const SurfacePatch& patch,
                                   const Transform& true_T_camera, const SurfaceMatchLimits& limits = {});

// A true surface is well in view where at least least_px of one of its planes are seen past the legs, not grazing,
// near, and over least_extent_m both ways. (The scorer of generated frames counts planes from 1500 pixels on, without
// the other limits; a tread 0.3 m deep and 1.2 m wide has 20,000 at 1 m.) 2026-11.
struct InViewLimits {
  int least_px = 3000;
  double least_extent_m = 0.06;  // 3 mm of depth error at one end of it are 3 deg, a third of the angle that matches
  double grazing_rad = 1.309;    // angle of incidence: 75 deg, where depth noise is four times that of a facing surface
  double range_m = 2.0;          // depth; the map is of what lies within 1.5 m
  double body_margin_m = 0.025;  // around the legs, as the self filter masks
};

class SurfaceVisibility {
 public:
  SurfaceVisibility(const StairWorld& world, const CameraIntrinsics& intrinsics);
  // Ids as of matching_surface; valid until the next call.
  [[nodiscard]] const std::vector<int>& in_view(const Transform& true_T_camera, const Transform& base_T_camera,
                                                const std::array<LegShapes, kFootCount>& base_legs,
                                                const InViewLimits& limits = {});

  [[nodiscard]] const TrueSurfaces& surfaces() const noexcept { return surfaces_; }

 private:
  // What is seen of a plane.
  struct Seen {
    int px = 0;
    Vec3 low_m = Vec3::Constant(1e9), high_m = Vec3::Constant(-1e9);
    [[nodiscard]] bool well(const InViewLimits& limits) const;
  };
  // Of a surface its nearer plane and its farther one: a riser under a nosing shows both.
  using SeenSurface = std::array<Seen, 2>;
  void see(const Vec3& point_m, int px);

  std::vector<SolidBox> solids_;
  TrueSurfaces surfaces_;
  std::vector<SeenSurface> seen_;  // by id
  std::vector<int> in_view_;
  DepthRenderer renderer_;
};

}  // namespace polygmap::sim
