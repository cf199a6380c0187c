// SPDX-License-Identifier: Apache-2.0
// Boxes by what they are in a building, each in a frame of its own: x ahead, y to the left, z up.
#pragma once

#include <string>

#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/world/kinds/world_plan.hpp"

namespace polygmap::sim {

// Turned about the vertical alone.
struct Frame {
  Vec3 p_m = Vec3::Zero();
  double yaw_deg = 0.0;

  [[nodiscard]] Vec3 at(const Vec3& p_in_frame_m) const noexcept {
    return p_m + rotation_z(yaw_deg * kPi / 180.0) * p_in_frame_m;
  }
  [[nodiscard]] Frame ahead(double x_m, double y_m = 0.0, double z_m = 0.0, double turned_deg = 0.0) const noexcept {
    return {at(Vec3(x_m, y_m, z_m)), yaw_deg + turned_deg};
  }
};

// What a tread is like.
struct TreadStyle {
  double width_m = 1.0;
  double nosing_m = 0.0;  // overhang over what is beneath
  double slab_m = 0.0;    // thickness of an open step's slab; 0: the steps are closed to the floor
};
// Of a top, about its middle.
struct Tilt {
  double roll_deg = 0.0, pitch_deg = 0.0;
};

class WorldBuilder {
 public:
  // The seed's world has this frame.
  explicit WorldBuilder(double yaw_deg = 0.0) { origin_.yaw_deg = yaw_deg; }
  [[nodiscard]] const Frame& origin() const noexcept { return origin_; }

  // About the frame's own axes.
  PlannedSolid& box(const Frame& at, const std::string& name, const Vec3& centre_m, const Vec3& size_m,
                    double roll_deg = 0.0, double pitch_deg = 0.0);
  // Its top begins at the frame, which is as high, and goes on ahead; down to below the floor, or as thick as it says.
  PlannedSolid& block(const Frame& edge, const std::string& name, double length_m, double width_m,
                      double thickness_m = 0.0, const Tilt& tilt = {});
  // The same, as steps are made; its slab ends where its nosing is.
  void tread(const Frame& edge, const std::string& name, double length_m, const TreadStyle& style,
             const Tilt& tilt = {});
  // What stands in the way, its foot's middle at the frame; not to be stood on.
  PlannedSolid& thing(const Frame& foot, const std::string& name, const Vec3& size_m);
  // From one point to another, a square bar.
  void bar(const Vec3& from_m, const Vec3& to_m, const std::string& name, double side_m);

  void start(const Frame& at, const std::string& surface);
  void goal(const Frame& at, const std::string& surface);
  // Both feet stand side by side there.
  void way(const Frame& at, const std::string& surface);
  void way_of_foot(const Frame& at, Foot foot, const std::string& surface);

  // No other goes on with it.
  [[nodiscard]] WorldPlan take(const std::string& what);

 private:
  Frame origin_;
  WorldPlan plan_;
};

// "0.153": of what a plan says.
[[nodiscard]] std::string metres(double value_m);

}  // namespace polygmap::sim
