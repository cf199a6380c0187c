// SPDX-License-Identifier: Apache-2.0
// A staircase as perception would report it from one camera pose: clipped by the picture, with noise on every figure.
#pragma once

#include <random>
#include <vector>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap::test {

// Stairs up along world heading yaw, first riser's foot in its middle at origin_m. The floor lies at origin_m.z().
struct Stairs {
  int steps = 5;
  double rise_m = 0.13;
  double tread_m = 0.28;
  double width_m = 1.2;
  double nosing_m = 0.0;
  double landing_m = 1.0;
  double yaw_rad = 0.0;
  Vec3 origin_m = Vec3::Zero();
  std::vector<int> missing = {};  // treads (1-based) that the picture lacks, with the riser beneath

  [[nodiscard]] Transform world_T_stairs() const { return {rotation_z(yaw_rad), origin_m}; }
  [[nodiscard]] double nosing_x_m(int step) const { return (step - 1) * tread_m - nosing_m; }
  [[nodiscard]] double back_x_m(int step) const { return (step - 1) * tread_m + (step == steps ? landing_m : tread_m); }
};

struct Noise {
  double edge_m = 0.0;    // each edge line and each vertex, per frame
  double offset_m = 0.0;  // each plane, per frame
  double tilt_rad = 0.0;
};

// The camera of a robot whose base is at that pose.
[[nodiscard]] Transform camera_of(const Transform& odom_T_base);
// Base pose of a robot standing upright with the middle between its soles at sole_m.
[[nodiscard]] Transform base_above(const Vec3& sole_m, double yaw_rad);
// Sole poses of that robot.
[[nodiscard]] std::array<Transform, kFootCount> soles_at(const Vec3& middle_m, double yaw_rad);

// Treads, risers and floor in view, in the camera frame; sigmas as the noise says, at least 1 mm.
[[nodiscard]] SurfaceFrame seen_from(const Stairs& stairs, const Transform& odom_T_camera, std::int64_t stamp_ns,
                                     const Noise& noise, std::mt19937& random);

}  // namespace polygmap::test
