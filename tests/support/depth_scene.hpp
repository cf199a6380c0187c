// SPDX-License-Identifier: Apache-2.0
// Depth pictures of boxes, a floor and legs for perception's tests: ray casting, independent of the simulation.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/robot/body_shapes.hpp"

namespace polygmap::test {

struct SceneBox {  // axis-parallel, world frame (x up the stairs, y left, z up; floor at z = 0)
  Vec3 min_m;
  Vec3 max_m;
};

struct StairSpec {
  int steps = 4;
  double rise_m = 0.15;
  double tread_m = 0.28;
  double first_riser_x_m = 0.3;
  double width_m = 1.2;
  double nosing_m = 0.0;
  double landing_m = 1.0;
};

struct DepthScene {
  Transform world_T_camera;
  CameraIntrinsics intrinsics;
  std::vector<SceneBox> boxes;
  bool floor = true;
  std::array<LegShapes, kFootCount> legs{};  // camera frame; radius and size 0: absent

  // The camera above the origin: pitch down and yaw from the stairs' axis, roll about the optical axis.
  void place_camera(double height_m, double pitch_rad, double yaw_rad = 0.0, double roll_rad = 0.0, double y_m = 0.0);
  void add_stairs(const StairSpec& stairs);
  [[nodiscard]] Vec3 camera_up() const { return world_T_camera.R.transpose() * Vec3::UnitZ(); }
};

struct DepthPicture {
  CameraIntrinsics intrinsics;
  std::vector<double> depth_m;  // 0 = nothing hit
  std::vector<double> cosine;   // of the incidence angle
  [[nodiscard]] std::vector<std::uint16_t> raw() const;
};

[[nodiscard]] DepthPicture render(const DepthScene& scene);

// The noise model of every test here: sigma (1 + 1.5 z) mm / cos(incidence) clamped at 75 degrees. Flying pixels
// replace 40 % of the pixels at jumps over 30 mm. Correlated noise has a correlation of 9 pixels, a warp of 2 mm over
// 71 pixels and dropouts in blobs; white noise drops single pixels.
struct NoiseSpec {
  bool correlated = false;
  double strength = 1.0;
  double dropout = 0.05;
};
void add_noise(DepthPicture& picture, const NoiseSpec& noise, std::uint32_t seed);

}  // namespace polygmap::test
