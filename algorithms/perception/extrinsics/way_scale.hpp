// SPDX-License-Identifier: Apache-2.0
// By how much farther the robot goes than its legs say, as the treads show.
#pragma once

#include <array>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/surfaces.hpp"

namespace polygmap {

// Legs that are longer than their data sheet go farther and higher than odometry has it, in proportion. Treads do not
// move: one that seems to come towards the robot, by a share of the way, says so. Each tread's nosing is held against
// its own mean, so only what changes with the way counts; the data sheet says how large the scale may be.
class WayScale {
 public:
  struct Params {
    double legs_share = 0.005;
    double along_sigma_m = 0.005;
    double up_sigma_m = 0.002;
    double alike_m = 0.2;
    double turned_rad = 0.03;
    double nearest_m = 0.25, farthest_m = 1.2;

    static void visit(auto& p, auto& field) {
      field("legs_share", p.legs_share, 1e-6, 0.1, "Length of both legs by the data sheet, relative.");
      field("along_sigma_m", p.along_sigma_m, 1e-4, 0.1, "Place of a nosing ahead that one frame sees.");
      field("up_sigma_m", p.up_sigma_m, 1e-4, 0.1, "Height of a tread that one frame sees.");
      field("alike_m", p.alike_m, 0.001, 10.0, "Frames on as much of the way err alike.");
      field("turned_rad", p.turned_rad, 0.001, 0.5,
            "A nosing counts while the camera looks the way it did at first: by a turn, what the mount's yaw is off "
            "would move it.");
      field("nearest_m", p.nearest_m, 0.0, 5.0, "A nosing counts from this far ahead of the base.");
      field("farthest_m", p.farthest_m, 0.0, 5.0, "A nosing counts up to this far ahead of the base.");
      field.ordered("nearest_m", "farthest_m");
    }
  };

  WayScale() noexcept : WayScale(Params{}) {}
  explicit WayScale(const Params& params) noexcept : params_(params) {}

  // One finished frame and the pose at its exposure.
  void update(const SurfaceFrame& frame, const Transform& odom_T_camera, const Vec3& odom_p_base_m) noexcept;

  // 0.01: the robot goes 1 % farther than its legs say. Of three sigmas of the data sheet at most.
  [[nodiscard]] double excess() const noexcept;

 private:
  // Places are along the nosing's normal in plan, and up.
  struct Tread {
    Vec2 ahead = Vec2::UnitX();   // that normal, away from the robot, as first seen
    Vec2 looked = Vec2::UnitX();  // the way of the camera's x axis then, in plan
    Vec2 last_m = Vec2::Zero();   // where the nosing was seen last
    double way_m = 0.0;           // that the means below are made of
    Vec2 mean_base_m = Vec2::Zero();
    Vec2 mean_nosing_m = Vec2::Zero();
  };
  static constexpr std::size_t kTreads = 8;  // in range at once are no more than five

  void add(const EdgeLine& odom_nosing, const Vec2& looks, const Vec3& odom_p_base_m, double way_m) noexcept;
  // Where the nosing crosses the base's way along the tread's normal.
  [[nodiscard]] static Vec2 place_m(const Tread& tread, const EdgeLine& odom_nosing,
                                    const Vec3& odom_p_base_m) noexcept;

  Params params_;
  std::array<Tread, kTreads> treads_{};
  std::size_t known_ = 0;  // treads so far; a new one takes the oldest one's place
  bool begun_ = false;
  Vec3 last_base_m_ = Vec3::Zero();
  double information_ = 0.0;
  double weighted_ = 0.0;
};

}  // namespace polygmap
