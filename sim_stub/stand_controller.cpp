// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/stand_controller.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "algorithms/robot/leg_dynamics.hpp"
#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {

JointCommand StandController::command(const Plant& plant) {
  const JointVector torque_nm = torques_nm(plant);
  JointCommand command;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    const std::size_t j = n % kJointsPerLeg;
    command.joints[n] = {q_rad_[i], 0.0, torque_nm[i], gains_.kp_nmprad[j], gains_.kd_nmsprad[j]};
  }
  return command;
}

JointVector StandController::torques_nm(const Plant& plant) {
  const Vec3 com_m = plant.true_p_com_m();
  if (!math::all_finite(com_m)) return JointVector::Zero();  // a plant without weight
  if (!centre_) centre_ = {com_m, com_m};
  const Vec3 velocity_mps = (com_m - centre_->last_m) / kPlantTick_s;
  centre_->last_m = com_m;

  const MassModel& masses = nominal_robot().masses;
  const std::array<Vec3, kFootCount> sole_m{plant.true_T_sole(0).p_m, plant.true_T_sole(1).p_m};
  const Vec3 middle_m = 0.5 * (sole_m[0] + sole_m[1]);
  const double height_m = com_m.z() - middle_m.z(), omega_radps = std::sqrt(kGravity_mps2 / height_m);
  constexpr double kGain = 2.5;
  const Vec2 off_m = (com_m - centre_->first_m + velocity_mps / omega_radps).head<2>();
  const Vec2 zmp_m = centre_->first_m.head<2>() + kGain * off_m;

  // Sideways the soles share, along them the pressure moves within each.
  const Vec3 apart_m = sole_m[0] - sole_m[1];
  const Vec2 left = apart_m.head<2>().normalized(), ahead{left.y(), -left.x()};
  const Vec2 from_middle_m = zmp_m - middle_m.head<2>();
  const double share = math::clamp(0.5 + from_middle_m.dot(left) / apart_m.norm(), 0.1, 0.9);
  const SoleRectangle& edges = nominal_robot().sole.contact;
  constexpr double kEdge_m = 0.01;
  const double ahead_m = math::clamp(from_middle_m.dot(ahead), edges.heel_x_m + kEdge_m, edges.toe_x_m - kEdge_m);

  const double weight_n = kGravity_mps2 * masses.total_kg();
  const Vec2 slope = (com_m.head<2>() - zmp_m) / height_m;
  const Vec3 force_n{weight_n * slope.x(), weight_n * slope.y(), weight_n};
  const Mat3 base_R_true = plant.true_T_base().R.transpose();
  const BodyFrames frames = body_frames(nominal_robot().legs, plant.true_q_rad());
  std::array<Vec3, kJointsPerLeg> specific_mps2;
  specific_mps2.fill(base_R_true * Vec3{0, 0, -kGravity_mps2});
  JointVector torque_nm;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const Vec3 part_n = (leg == Foot::kLeft ? share : 1.0 - share) * force_n;
    const Vec3 lever_m{ahead_m * ahead.x(), ahead_m * ahead.y(), 0.0};
    const SoleWrench ground{base_R_true * part_n, base_R_true * lever_m.cross(part_n)};
    torque_nm.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
        leg_torques_nm(masses, leg, frames[index_of(leg)], specific_mps2, ground);
  }
  return torque_nm;
}

}  // namespace polygmap::sim
