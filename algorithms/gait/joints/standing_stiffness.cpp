// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/joints/standing_stiffness.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "algorithms/robot/leg_dynamics.hpp"

namespace polygmap {
namespace {

// Of a leg and half the torso, above a height and beyond a joint: sum of m g (z - z_joint).
double toppling_nmprad(const MassModel& masses, const PerLink& base_p_m, double joint_z_m,
                       std::size_t links_above) noexcept {
  double moment_kgm = 0.5 * masses.torso.mass_kg * (base_p_m.torso.z() - joint_z_m);
  for (std::size_t link = 0; link < links_above; ++link) {
    moment_kgm += masses.leg[link].mass_kg * (base_p_m.leg[0][link].z() - joint_z_m);
  }
  return kGravity_mps2 * moment_kgm;
}

double weaker_kp(const RobotModel& robot, const JointReference::Params& params, LegJoint joint) noexcept {
  double kp_nmprad = params.hold_kp_nmprad;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    kp_nmprad = std::min(kp_nmprad, robot.drives.gain_limits[joint_index(leg, joint)].kp_nmprad);
  }
  return std::max(kp_nmprad, 1e-3);
}

double largest_eigenvalue(const Mat3& symmetric) noexcept {
  return Eigen::SelfAdjointEigenSolver<Mat3>(symmetric, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

}  // namespace

StandingStiffness standing_stiffness(const RobotModel& robot, const JointReference::Params& params) noexcept {
  JointVector q_rad;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const Vec3 sole_m{0.0, side_sign(leg) * robot.stance.half_width_m, -robot.stance.base_height_m};
    q_rad.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
        solve_leg(robot.legs, leg, {Mat3::Identity(), sole_m}).q_rad;
  }
  const BodyFrames frames = body_frames(robot.legs, q_rad);
  const PerLink base_p_m = base_p_links_m(robot.masses, frames);

  // Upwards. What a pitch joint carries: the links of the leg before it, seen from the base.
  constexpr std::array<LegJoint, 3> kPitch{kAnklePitch, kKnee, kHipPitch};
  std::array<double, 3> topples_nmprad{};
  Vec3 kp_nmprad;
  for (std::size_t i = 0; i < kPitch.size(); ++i) {
    topples_nmprad[i] = toppling_nmprad(robot.masses, base_p_m, frames[0].joint[kPitch[i]].p_m.z(), kPitch[i]);
    kp_nmprad[static_cast<Eigen::Index>(i)] = weaker_kp(robot, params, kPitch[i]);
  }
  Mat3 G, scaled;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      G(i, j) = topples_nmprad[static_cast<std::size_t>(std::max(i, j))];
      scaled(i, j) = G(i, j) / math::sqrt(kp_nmprad[i] * kp_nmprad[j]);
    }
  }
  StandingStiffness stiffness;
  stiffness.from_the_side = largest_eigenvalue(scaled);
  stiffness.least_kp_nmprad = largest_eigenvalue(G) / kMaxTopplingShare;

  // The legs turn about the ankles; the torso moves with the hips' roll axes and stays level.
  const double ankle_z_m = frames[0].joint[kAnkleRoll].p_m.z(), hip_z_m = frames[0].joint[kHipRoll].p_m.z();
  double moment_kgm = 0.5 * robot.masses.torso.mass_kg * (hip_z_m - ankle_z_m);
  for (std::size_t link = 0; link < kAnkleRoll; ++link) {
    moment_kgm += robot.masses.leg[link].mass_kg * (base_p_m.leg[0][link].z() - ankle_z_m);
  }
  stiffness.from_the_front =
      kGravity_mps2 * moment_kgm / (weaker_kp(robot, params, kHipRoll) + weaker_kp(robot, params, kAnkleRoll));
  return stiffness;
}

}  // namespace polygmap
