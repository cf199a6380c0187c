// SPDX-License-Identifier: Apache-2.0
// What an ideal depth camera sees of floor, stairs and the robot's own legs.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/robot/body_shapes.hpp"
#include "sim_stub/clearance.hpp"

namespace polygmap::sim {

struct DepthScene {
  Transform true_T_camera;
  std::span<const SolidBox> solids;  // true world frame; the floor is always there
  std::array<LegShapes, kFootCount> base_legs;
  Transform base_T_camera;
  bool legs_visible = true;
};

// On a plane, inverse depth is linear in the pixel's column, and a face is one span per row: a picture is a few hundred
// thousand multiply-adds. Only the legs' capsules are cast ray by ray.
class DepthRenderer {
 public:
  explicit DepthRenderer(const CameraIntrinsics& intrinsics);

  void render(const DepthScene& scene);

  [[nodiscard]] const CameraIntrinsics& intrinsics() const noexcept { return intrinsics_; }
  // One row of 1 / depth, 1/m; 0 where nothing is hit.
  [[nodiscard]] const float* inverse_depth(int row) const noexcept { return inverse_depth_.data() + offset(row); }
  // Distance from the camera to the surface's tangent plane, m, and 1 / |ray| for a ray with z = 1: with the inverse
  // depth their product is the cosine of the incidence angle.
  [[nodiscard]] const float* plane_distance(int row) const noexcept { return plane_distance_.data() + offset(row); }
  [[nodiscard]] const float* inverse_length(int row) const noexcept { return inverse_length_.data() + offset(row); }

 private:
  void draw_box(const Transform& camera_T_box, const Vec3& half_m);
  void draw_face(std::span<const Vec3> corners_m, const Vec3& normal);
  void draw_capsule(const Capsule& capsule);
  [[nodiscard]] std::size_t offset(int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(intrinsics_.width_px);
  }

  CameraIntrinsics intrinsics_;
  std::vector<float> inverse_depth_, plane_distance_, inverse_length_;
  std::vector<double> left_px_, right_px_;  // the face being drawn, per row
};

}  // namespace polygmap::sim
