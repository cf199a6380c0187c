// SPDX-License-Identifier: Apache-2.0
// The biped and its stairs in MuJoCo's own language, written from lengths and masses: no model file of anybody's.
#pragma once

#include <string>

#include "sim_stub/plant/mujoco_plant.hpp"

namespace polygmap::sim {

// Bodies "base", "left_1".."right_6" (one per joint, in the order of LegJoint), geoms "floor" and "solid_K", the boxes
// of solids_of().
[[nodiscard]] std::string mujoco_model(const MujocoPlant::Params& params, const StairWorld& world,
                                       const RobotErrors& errors);

}  // namespace polygmap::sim
