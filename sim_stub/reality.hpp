// SPDX-License-Identifier: Apache-2.0
// What a real robot has and its data sheet does not say: every number in which the simulation may differ from what the
// module believes, by one name each. The module keeps the data sheet.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim_stub/camera/camera_errors.hpp"
#include "sim_stub/plant/mujoco_plant.hpp"
#include "sim_stub/sensors/robot_errors.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

struct Reality {
  ErrorParams sensors;
  MujocoPlant::Params plant;
  CameraErrors camera;
  StairErrors stairs;

  static void visit(auto& p, auto& field) {
    field("sensors", p.sensors);
    field("plant", p.plant);
    field("camera", p.camera);
    field("stairs", p.stairs);
  }
};

// A number leaves its default, at scale 1, by what is drawn evenly from least to most: each of several alone.
struct RealityItem {
  std::string_view name;  // as in param_table(Reality)
  double least, most;
};
[[nodiscard]] std::span<const RealityItem> reality_items() noexcept;

// Scale 0 is the robot of the data sheet with the sensors' plain noise, 1 what a real one is like, 2 twice as bad. What
// would leave an item's range stays at its end.
[[nodiscard]] Reality draw_reality(double scale, std::uint64_t seed);

// An item by its name, as in "sensors.foot_force_noise_n=20" or "sensors.lio_jump_m=[0.06, 0, 0]". Empty, or one
// sentence, and nothing changes.
[[nodiscard]] std::string set_item(Reality& reality, const std::string& assignment);

// Every number, in the table's order: "plant.friction" and its value as text.
struct NamedValue {
  std::string name, text;
};
[[nodiscard]] std::vector<NamedValue> values_of(const Reality& reality);

}  // namespace polygmap::sim
