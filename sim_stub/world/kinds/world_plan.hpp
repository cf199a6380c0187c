// SPDX-License-Identifier: Apache-2.0
// A world of boxes as its file says it (docs/reference/world.md), before it is read: what a kind of worlds draws.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/math/transform.hpp"

namespace polygmap::sim {

struct PlannedSolid {
  std::string name;
  Vec3 centre_m = Vec3::Zero();
  Vec3 size_m = Vec3::Zero();
  Vec3 rpy_deg = Vec3::Zero();
  bool is_walkable = true;
  bool is_glass = false;
};

struct PlannedPlace {
  double x_m = 0.0, y_m = 0.0;
  std::optional<double> yaw_deg;
  std::string surface = "floor";
};

struct WorldPlan {
  std::string what;  // was drawn, in words
  PlannedPlace start;
  std::optional<PlannedPlace> goal;
  std::vector<PlannedSolid> solids;
  // Where a foot finds place, the middle of its contact rectangle, on each surface that has to be stood on: shows that
  // the world can be walked, and is no part of its file.
  std::vector<PlannedPlace> way;
};

// The text of its file: lengths to 0.1 mm, angles to 0.001 degrees.
[[nodiscard]] std::string to_toml(const WorldPlan& plan);

}  // namespace polygmap::sim
