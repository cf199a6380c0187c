// SPDX-License-Identifier: Apache-2.0
#include "algorithms/robot/leg_dynamics.hpp"

#include <Eigen/Geometry>

#include "algorithms/robot/leg_frames.hpp"

namespace polygmap {
namespace {

Vec3 base_p_link(const LegFrames& frames, const MassModel& masses, Foot leg, std::size_t link) noexcept {
  const Vec3& c = masses.leg[link].centre_m;
  return frames.joint[link] * Vec3{c.x(), side_sign(leg) * c.y(), c.z()};
}

}  // namespace

CentreOfMass centre_of_mass(const LegGeometry& geometry, const MassModel& masses, const JointVector& q_rad,
                            const JointVector& dq_radps) noexcept {
  Vec3 moment_kgm = masses.torso.mass_kg * masses.torso.centre_m;
  Vec3 momentum = Vec3::Zero();
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegFrames f = leg_frames(geometry, leg, leg_joints(q_rad, leg));
    const LegVector dq = leg_joints(dq_radps, leg);
    // From the sole upwards: every joint moves all that hangs on it.
    double hanging_kg = 0.0;
    Vec3 hanging_kgm = Vec3::Zero();
    for (std::size_t j = kJointsPerLeg; j-- > 0;) {
      hanging_kg += masses.leg[j].mass_kg;
      hanging_kgm += masses.leg[j].mass_kg * base_p_link(f, masses, leg, j);
      const Vec3 axis = f.joint[j].R.col(kJointAxis[j]);
      momentum += dq[static_cast<Eigen::Index>(j)] * axis.cross(hanging_kgm - hanging_kg * f.joint[j].p_m);
    }
    moment_kgm += hanging_kgm;
  }
  return {moment_kgm / masses.total_kg(), momentum / masses.total_kg()};
}

PerLink base_p_links_m(const LegGeometry& geometry, const MassModel& masses, const JointVector& q_rad) noexcept {
  PerLink points;
  points.torso = masses.torso.centre_m;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegFrames f = leg_frames(geometry, leg, leg_joints(q_rad, leg));
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) points.leg[index_of(leg)][j] = base_p_link(f, masses, leg, j);
  }
  return points;
}

LegVector leg_torques_nm(const LegGeometry& geometry, const MassModel& masses, Foot leg, const LegVector& q_rad,
                         const std::array<Vec3, kJointsPerLeg>& specific_mps2, const SoleWrench& ground) noexcept {
  const LegFrames f = leg_frames(geometry, leg, q_rad);
  LegVector torque_nm;
  Vec3 force_n = ground.force_n;  // on all that hangs on the joint, and its moment about the base's origin
  Vec3 moment_nm = ground.moment_nm + f.sole.p_m.cross(ground.force_n);
  for (std::size_t j = kJointsPerLeg; j-- > 0;) {
    const Vec3 weight_n = masses.leg[j].mass_kg * specific_mps2[j];
    force_n += weight_n;
    moment_nm += base_p_link(f, masses, leg, j).cross(weight_n);
    const Vec3 axis = f.joint[j].R.col(kJointAxis[j]);
    torque_nm[static_cast<Eigen::Index>(j)] = -axis.dot(moment_nm - f.joint[j].p_m.cross(force_n));
  }
  return torque_nm;
}

}  // namespace polygmap
