// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/link_motion.hpp"

#include <Eigen/Geometry>

namespace polygmap {
namespace {

constexpr double kLimit_mps2 = 60.0;  // a guard beyond any planned motion

Vec3 second_difference(const Vec3& now, const Vec3& before, const Vec3& first) noexcept {
  const Vec3 mps2 = (now - 2.0 * before + first) / math::square(kTick_s);
  return mps2.cwiseMax(-kLimit_mps2).cwiseMin(kLimit_mps2);
}

}  // namespace

LinkMotion::Acceleration LinkMotion::update(const Transform& plan_T_base, const PerLink& base_p_m,
                                            const JointVector& q_rad) noexcept {
  Posture now{base_p_m, q_rad};
  now.plan_p_m.torso = plan_T_base * now.plan_p_m.torso;
  for (auto& leg : now.plan_p_m.leg) {
    for (Vec3& link : leg) link = plan_T_base * link;
  }
  Acceleration a;
  if (known_ == 2) {
    const Posture &b = past_[0], &c = past_[1];
    a.plan_mps2.torso = second_difference(now.plan_p_m.torso, b.plan_p_m.torso, c.plan_p_m.torso);
    for (std::size_t f = 0; f < kFootCount; ++f) {
      for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
        a.plan_mps2.leg[f][j] = second_difference(now.plan_p_m.leg[f][j], b.plan_p_m.leg[f][j], c.plan_p_m.leg[f][j]);
      }
    }
    a.joint_radps2 = (now.q_rad - 2.0 * b.q_rad + c.q_rad) / math::square(kTick_s);
  }
  past_[1] = past_[0];
  past_[0] = now;
  if (known_ < 2) ++known_;
  return a;
}

void LinkMotion::carry(const Transform& to_T_plan) noexcept {
  for (Posture& posture : past_) {
    posture.plan_p_m.torso = to_T_plan * posture.plan_p_m.torso;
    for (auto& leg : posture.plan_p_m.leg) {
      for (Vec3& link : leg) link = to_T_plan * link;
    }
  }
}

Vec3 angular_momentum_rate_nm(const MassModel& masses, const PerLink& p_m, const PerLink& mps2) noexcept {
  Vec3 centre_kgm = masses.torso.mass_kg * p_m.torso;
  Vec3 force_n = masses.torso.mass_kg * mps2.torso;
  Vec3 moment_nm = p_m.torso.cross(force_n);
  for (std::size_t f = 0; f < kFootCount; ++f) {
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      const double kg = masses.leg[j].mass_kg;
      centre_kgm += kg * p_m.leg[f][j];
      force_n += kg * mps2.leg[f][j];
      moment_nm += kg * p_m.leg[f][j].cross(mps2.leg[f][j]);
    }
  }
  return moment_nm - (centre_kgm / masses.total_kg()).cross(force_n);
}

}  // namespace polygmap
