// SPDX-License-Identifier: Apache-2.0
// The simulated robot's camera is the robot's.
#pragma once

#include "firmware/robot_camera.hpp"
