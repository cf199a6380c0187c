// SPDX-License-Identifier: Apache-2.0
// A motion at one moment: what trajectories start from and what the balance follows.
#pragma once

#include "algorithms/core/math/math.hpp"

namespace polygmap {

struct Motion {  // of one coordinate, SI units per second
  double position = 0.0;
  double speed = 0.0;
  double acceleration = 0.0;
};

struct HorizontalMotion {
  Vec2 position_m = Vec2::Zero();
  Vec2 velocity_mps = Vec2::Zero();
  Vec2 acceleration_mps2 = Vec2::Zero();
};

}  // namespace polygmap
