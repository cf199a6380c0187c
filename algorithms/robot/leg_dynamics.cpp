// SPDX-License-Identifier: Apache-2.0
#include "algorithms/robot/leg_dynamics.hpp"

#include <Eigen/Geometry>

namespace polygmap {
namespace {

Vec3 base_p_link(const LegFrames& frames, const MassModel& masses, Foot leg, std::size_t link) noexcept {
  const Vec3& c = masses.leg[link].centre_m;
  return frames.joint[link] * Vec3{c.x(), side_sign(leg) * c.y(), c.z()};
}

}  // namespace

Vec3 centre_of_mass_m(const MassModel& masses, const PerLink& p_m) noexcept {
  Vec3 moment_kgm = masses.torso.mass_kg * p_m.torso;
  for (const auto& leg : p_m.leg) {
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) moment_kgm += masses.leg[j].mass_kg * leg[j];
  }
  return moment_kgm / masses.total_kg();
}

Vec3 base_v_com_mps(const MassModel& masses, const BodyFrames& frames, const PerLink& base_p_m,
                    const JointVector& dq_radps) noexcept {
  Vec3 momentum = Vec3::Zero();
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegFrames& f = frames[index_of(leg)];
    // From the sole upwards: every joint moves all that hangs on it.
    double hanging_kg = 0.0;
    Vec3 hanging_kgm = Vec3::Zero();
    for (std::size_t j = kJointsPerLeg; j-- > 0;) {
      hanging_kg += masses.leg[j].mass_kg;
      hanging_kgm += masses.leg[j].mass_kg * base_p_m.leg[index_of(leg)][j];
      const Vec3 axis = f.joint[j].R.col(kJointAxis[j]);
      const double dq = dq_radps[static_cast<Eigen::Index>(joint_index(leg, j))];
      momentum += dq * axis.cross(hanging_kgm - hanging_kg * f.joint[j].p_m);
    }
  }
  return momentum / masses.total_kg();
}

PerLink base_p_links_m(const MassModel& masses, const BodyFrames& frames) noexcept {
  PerLink points;
  points.torso = masses.torso.centre_m;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const std::size_t f = index_of(leg);
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) points.leg[f][j] = base_p_link(frames[f], masses, leg, j);
  }
  return points;
}

LegVector leg_torques_nm(const MassModel& masses, Foot leg, const LegFrames& f,
                         const std::array<Vec3, kJointsPerLeg>& specific_mps2, const SoleWrench& ground) noexcept {
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
