// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/ground_force_observer.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {
namespace {

// Velocities of a leg's links relative to the base's origin, base axes; the base turns, too.
std::array<Vec3, kJointsPerLeg> link_velocities_mps(const LegFrames& frames, const std::array<Vec3, kJointsPerLeg>& p_m,
                                                    const LegVector& dq_radps, const Vec3& base_w_radps) noexcept {
  std::array<Vec3, kJointsPerLeg> v_mps;
  Vec3 w_radps = base_w_radps, at_origin_mps = Vec3::Zero();
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const Vec3 turn_radps = dq_radps[static_cast<Eigen::Index>(j)] * frames.joint[j].R.col(kJointAxis[j]);
    w_radps += turn_radps;
    at_origin_mps -= turn_radps.cross(frames.joint[j].p_m);
    v_mps[j] = at_origin_mps + w_radps.cross(p_m[j]);
  }
  return v_mps;
}

}  // namespace

void GroundForceObserver::reset(const Params& params) noexcept {
  *this = GroundForceObserver{};
  params_ = params;
  for (Leg& leg : legs_) leg.friction_nm.setConstant(params.friction_nm);
}

std::array<double, kFootCount> GroundForceObserver::update(const RobotModel& robot, const BodyFrames& frames,
                                                           const JointFeedback& joints, const ImuSample& base,
                                                           const Vec3& base_up,
                                                           const std::array<bool, kFootCount>& hangs) noexcept {
  const bool first = stamp_ns_ < 0;
  const double dt_s = first ? 0.0 : seconds(joints.stamp_ns - stamp_ns_);
  const double share = first ? 1.0 : dt_s / (params_.smoothing_s + dt_s), rate_ps = 1.0 / params_.smoothing_s;
  const double learnt_s = std::min(dt_s, params_.smoothing_s);  // after a gap, too
  const double learning_friction = learnt_s / params_.friction_s, learning_armature = learnt_s / params_.armature_s;
  stamp_ns_ = joints.stamp_ns;
  felt_mps2_ += share * (base.accel_mps2 - felt_mps2_);
  const PerLink p_m = base_p_links_m(robot.masses, frames);
  std::array<double, kFootCount> upwards_n{};
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const auto foot = static_cast<Foot>(f);
    const LegVector dq_radps = leg_joints(joints.dq_radps, foot);
    const auto v_mps = link_velocities_mps(frames[f], p_m.leg[f], dq_radps, base.gyro_radps);
    Leg& leg = legs_[f];
    if (first) {
      leg.link_mps = v_mps;
      leg.armature_kgm2.setConstant(robot.drives.armature_kgm2);
    }
    std::array<Vec3, kJointsPerLeg> specific_mps2;
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      leg.link_mps[j] += share * (v_mps[j] - leg.link_mps[j]);
      specific_mps2[j] = -felt_mps2_ - rate_ps * (v_mps[j] - leg.link_mps[j]) - base.gyro_radps.cross(v_mps[j]);
    }
    leg.drive_nm += share * (leg_joints(joints.tau_nm, foot) - leg.drive_nm);
    leg.dq_radps += share * (dq_radps - leg.dq_radps);
    LegVector left_nm = leg.drive_nm - leg_torques_nm(robot.masses, foot, frames[f], specific_mps2, {});
    for (Eigen::Index j = 0; j < left_nm.size(); ++j) {
      double& way = leg.way[j];
      way += share * (math::clamp(dq_radps[j] / params_.creep_radps, -1.0, 1.0) - way);
      double& friction_nm = leg.friction_nm[j];
      double& armature_kgm2 = leg.armature_kgm2[j];
      const double accel_radps2 = rate_ps * (dq_radps[j] - leg.dq_radps[j]);
      left_nm[j] -= armature_kgm2 * accel_radps2 + friction_nm * way;
      if (!hangs[f]) continue;  // on the ground a joint that hardly turns may be held either way
      // Nothing else is left in the air but what masses are off. For friction that goes both ways of a swing alike; of
      // the armature it is a part, as of a heavier drive.
      friction_nm = math::clamp(friction_nm + learning_friction * way * left_nm[j], 0.0, params_.most_friction_nm);
      const double tells = accel_radps2 / (math::square(accel_radps2) + math::square(params_.brisk_radps2));
      armature_kgm2 = math::clamp(armature_kgm2 + learning_armature * tells * left_nm[j], 0.0,
                                  robot.drives.armature_kgm2 + params_.more_armature_kgm2);
    }
    const LegJacobian J = leg_jacobian(frames[f]);
    Eigen::Matrix<double, 6, 6> A = J * J.transpose();
    A.diagonal().array() += math::square(params_.damping_m);
    const Eigen::Matrix<double, 6, 1> wrench = -A.llt().solve(J * left_nm);
    upwards_n[f] = wrench.head<3>().dot(base_up);
  }
  return upwards_n;
}

}  // namespace polygmap
