// SPDX-License-Identifier: Apache-2.0
// Tops of a world file's solids, seen from above: which are one, and how far within them a sole stands.
#pragma once

#include <span>

#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

inline constexpr double kSameTop_m = 0.005;  // tops that touch and differ in height by less are one
inline constexpr double kSlit_m = 0.001;     // tops that are no farther apart touch

// Fills in the groups of the steps.
void group_tops(StairWorld& world);

// How far the contact rectangle could grow on every side, its corners rounded, and still lie on tops as high as the
// step's: kMostMargin_m at most, +inf on what is one with the floor. Negative: how far it reaches beyond them, of a
// gap beneath it to the gap's middle.
inline constexpr double kMostMargin_m = 0.5;
[[nodiscard]] double margin_on_tops_m(const Transform& true_T_sole, const StairWorld& world, int step,
                                      const SoleModel& sole);

// From the point against the heading to where these tops end, or where a higher one begins above them; NaN on the
// floor.
[[nodiscard]] double edge_behind_m(const Vec3& point_m, double yaw_rad, const StairWorld& world, int step);

}  // namespace polygmap::sim
