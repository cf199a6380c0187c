// SPDX-License-Identifier: Apache-2.0
// What estimation tells everybody else.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

// The state of one tick. odom: smooth, drifts slowly, never jumps. world: odom corrected by LIO (eqs 5-10).
struct StateEstimate {
  std::int64_t stamp_ns = 0;
  // Of the newest IMU and the newest joint sample, the older one's stamp; a drive or a feet's board that is silent for
  // more than a few cycles makes the joint sample as old as its last reply.
  std::int64_t oldest_input_ns = 0;
  // The same without what is silent: such joints count as held where they were, such feet stand as planned. But where
  // no leg has stood for a second, when one did last: by the IMU alone the velocity drifts.
  std::int64_t heard_ns = 0;
  Transform odom_T_base;
  Transform world_T_odom;  // the low-passed LIO offset: changes slowly
  Vec3 odom_v_base_mps = Vec3::Zero();
  Vec3 base_w_base_radps = Vec3::Zero();
  JointVector q_rad = JointVector::Zero();        // as measured
  std::array<Transform, kFootCount> odom_T_sole;  // leg kinematics on odom_T_base; sole frame: robot_model.hpp
  std::array<double, kFootCount> contact_probability{};
  std::array<double, kFootCount> foot_force_sigma_n{};  // of the joint feedback's; 0 or no number: not known
  Vec3 position_sigma_m = Vec3::Zero();                 // of world_p_base
  // By which the IMU turned out to be mounted otherwise than it was taken to be: odom_T_base.R is turned by so much
  // against that of the tick before, odometry axes, without any motion. 0 in all other ticks.
  Vec3 odom_turned_rad = Vec3::Zero();
  double odom_sigma_m = 0.0;  // of odom_p_base along the axis that is known worst; grows with the way
  Vec3 velocity_sigma_mps = Vec3::Zero();
  double yaw_sigma_rad = 0.0;
  double tilt_sigma_rad = 0.0;   // of odom's roll and pitch against those of the start
  std::int64_t lio_age_ns = -1;  // since the stamp of the last accepted LIO pose; -1: none yet
  bool initialised = false;      // false while the robot must stand still for bias and alignment

  [[nodiscard]] Transform world_T_base() const noexcept { return world_T_odom * odom_T_base; }
};

}  // namespace polygmap
