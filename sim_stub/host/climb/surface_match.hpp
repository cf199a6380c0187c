// SPDX-License-Identifier: Apache-2.0
// Is a surface that perception reports one that truly exists?
#pragma once

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

// Wide enough for the simulated sensor (noise, 0.3 % scale, 2 mm warp) and the slivers of far risers, far too narrow
// for the robot's own foot (its top stands 70 mm above the sole) or for the plane through a row of nosings (25 deg).
struct SurfaceMatchLimits {
  double angle_rad = 0.1745;  // between the normals
  double distance_m = 0.03;   // of every vertex from the true plane
  double overhang_m = 0.05;   // of the centroid beyond the true surface's edges
};

// patch in the camera frame, true_T_camera at its exposure. True surfaces: floor, treads, risers and the sides.
[[nodiscard]] bool matches_true_surface(const StairWorld& world, const SurfacePatch& patch,
                                        const Transform& true_T_camera, const SurfaceMatchLimits& limits = {});

}  // namespace polygmap::sim
