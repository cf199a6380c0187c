// SPDX-License-Identifier: Apache-2.0
// How far a foot is from the true stairs: what the plant judges collisions by and the report measures.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "algorithms/robot/body_shapes.hpp"
#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

// Every step as a solid standing on the ground; with a nosing, its slab as a second solid; a worn one is a round bar
// between boxes; then the obstacles. The steps reach below the floor, so that nothing is ever pushed out downwards. Of
// a world file, its solids. Camera, physics and report have no other description of the world.
[[nodiscard]] std::vector<SolidBox> solids_of(const StairWorld& world);
// A round bar as a capsule, its ends within the solid's sides.
[[nodiscard]] Capsule bar_of(const SolidBox& solid) noexcept;

// Signed distance between a box and a solid, m: exact gap when apart, minus the penetration depth (the shortest way
// apart) otherwise.
[[nodiscard]] double signed_distance_m(const OrientedBox& box, const SolidBox& solid) noexcept;

// Least signed distance of a box in the true world frame to the floor and the solids, leaving out the steps in excluded
// (kFloorStep: the floor); at_most_m when that is less, and cheap then. +inf when nothing is left.
[[nodiscard]] double clearance_m(const OrientedBox& box, std::span<const SolidBox> solids,
                                 std::span<const int> excluded = {},
                                 double at_most_m = std::numeric_limits<double>::infinity()) noexcept;

// Least signed distance of the contact rectangle's corners, seen from above, to the edges of the tread of one step
// (nosing, next riser, sides; the landing's far end); negative = overhang. For kFloorStep the edge is the staircase.
// Of a staircase alone.
[[nodiscard]] double sole_margin_m(const Transform& true_T_sole, const StairWorld& world, int step,
                                   const SoleModel& sole = nominal_robot().sole) noexcept;
// The same for one point.
[[nodiscard]] double tread_margin_m(const Vec3& point_m, const StairWorld& world, int step) noexcept;

}  // namespace polygmap::sim
