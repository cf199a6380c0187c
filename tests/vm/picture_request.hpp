// SPDX-License-Identifier: Apache-2.0
// What the robot in the guest (guest_plant) asks the host's renderer (render_pictures) for: one picture, in two files
// of the host that the guest reaches by semihosting. While the host renders, no instruction of the guest runs, so its
// virtual time stands still: a picture costs the guest nothing, and every run is the same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sim_stub/sim_robot.hpp"

namespace polygmap::vm {

// True world frame; as it lies in memory, which is the same on both sides.
struct PictureMoment {
  std::array<double, 3> p_base_m{};
  std::array<double, 9> R_base{};  // row by row
  std::array<double, kJointCount> q_rad{};

  [[nodiscard]] static PictureMoment of(const sim::SimRobot& robot) noexcept {
    PictureMoment moment;
    const Transform& base = robot.truth().true_T_base;
    for (std::size_t i = 0; i < 3; ++i) moment.p_base_m[i] = base.p_m[static_cast<Eigen::Index>(i)];
    for (std::size_t i = 0; i < 9; ++i) {
      moment.R_base[i] = base.R(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3));
    }
    const JointVector q_rad = robot.true_q_rad();
    for (std::size_t j = 0; j < kJointCount; ++j) moment.q_rad[j] = q_rad[static_cast<Eigen::Index>(j)];
    return moment;
  }
  [[nodiscard]] Transform true_T_base() const noexcept {
    Transform base;
    for (std::size_t i = 0; i < 3; ++i) base.p_m[static_cast<Eigen::Index>(i)] = p_base_m[i];
    for (std::size_t i = 0; i < 9; ++i) {
      base.R(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) = R_base[i];
    }
    return base;
  }
};

struct PictureRequest {
  std::uint64_t number = 0;   // draws the noise
  double exposed_s = 0.0;     // since the robot began, the middle of the exposure
  PictureMoment first, last;  // when the upper and the lower edge were exposed
};
static_assert(sizeof(PictureRequest) == 50 * sizeof(double), "it has no padding");

// The one simulation of which the guest has the robot and the host the camera.
[[nodiscard]] inline sim::SimOptions sim_options(std::uint64_t seed, int steps) {
  sim::SimOptions options;
  options.seed = seed;
  options.stairs.steps = steps;
  options.imu_interval_ns = 5 * kNsPerMs;            // a Mid-360's, as the package has it
  options.camera.silent = {{INT64_MIN, INT64_MAX}};  // its own camera sees nothing
  options.camera.threaded = false;
  // This plant never tips onto a foot that hangs: one that the plan has 2.5 mm above the ground would hang for good,
  // with the body over it. Drives that give way by some millimetres keep such a foot on the ground.
  options.plant.lift_height_m = 0.005;
  return options;
}

}  // namespace polygmap::vm
