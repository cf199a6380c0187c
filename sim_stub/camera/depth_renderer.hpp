// SPDX-License-Identifier: Apache-2.0
// What an ideal depth camera sees of floor, stairs and the robot's own legs.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/robot/body_shapes.hpp"
#include "sim_stub/camera/counter_noise.hpp"
#include "sim_stub/world/clearance.hpp"

namespace polygmap::sim {

// One moment of what the camera sees.
struct DepthScene {
  Transform true_T_camera;
  std::span<const SolidBox> solids;  // true world frame; the floor is always there
  std::array<LegShapes, kFootCount> base_legs;
  Transform base_T_camera;
  bool legs_visible = true;
};

// On a plane, inverse depth is linear in the pixel's column, and a face is one span per row: a picture is a few hundred
// thousand multiply-adds. Only the legs' capsules are cast ray by ray. Every row has its own moment, and with it its
// own pose of everything.
class DepthRenderer {
 public:
  explicit DepthRenderer(const CameraIntrinsics& intrinsics);

  void render(const DepthScene& scene) { render(scene, scene); }
  // The scene moves evenly from first (the upper edge of the picture) to last (the lower one); the solids stay.
  void render(const DepthScene& first, const DepthScene& last);
  // What is near grows by so many pixels over what is at least 30 mm behind it, as in the window of a matcher or in a
  // wide beam; of the last pixel a share grows, always the same ones.
  void fatten_edges(double px, const CounterNoise& noise);

  [[nodiscard]] const CameraIntrinsics& intrinsics() const noexcept { return intrinsics_; }
  // One row of 1 / depth, 1/m; 0 where nothing is hit.
  [[nodiscard]] const float* inverse_depth(int row) const noexcept { return inverse_depth_.data() + offset(row); }
  // Distance from the camera to the surface's tangent plane, m, and 1 / |ray| for a ray with z = 1: with the inverse
  // depth their product is the cosine of the incidence angle.
  [[nodiscard]] const float* plane_distance(int row) const noexcept { return plane_distance_.data() + offset(row); }
  [[nodiscard]] const float* inverse_length(int row) const noexcept { return inverse_length_.data() + offset(row); }
  // How much of the exposure has passed when a row is taken.
  [[nodiscard]] double moment_of(int row) const { return (row + 0.5) / intrinsics_.height_px; }

 private:
  // Camera frame, at one moment.
  struct Face {
    std::array<Vec3, 4> corners_m;
    Vec3 normal;
    [[nodiscard]] double distance_m() const { return -normal.dot(corners_m[0]); }
  };
  struct Rows {
    int first, last;
  };
  [[nodiscard]] static Face box_face(const Transform& camera_T_box, const Vec3& half_m, int axis, double sign);
  void draw_box(const Transform& first, const Transform& last, const Vec3& half_m);
  void draw_face(const Face& first, const Face& last);
  void draw_capsule(const Capsule& first, const Capsule& last);
  [[nodiscard]] Rows rows_of(const Face& first, const Face& last) const;
  [[nodiscard]] std::size_t offset(int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(intrinsics_.width_px);
  }

  CameraIntrinsics intrinsics_;
  std::vector<float> inverse_depth_, plane_distance_, inverse_length_;
};

}  // namespace polygmap::sim
