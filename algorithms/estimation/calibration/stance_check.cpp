// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/stance_check.hpp"

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {
namespace {

double angle_rad(const Vec3& a, const Vec3& b) noexcept { return math::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace

StanceCheck::Leans StanceCheck::leans(const LegGeometry& legs, const JointVector& q_rad,
                                      const Vec3& base_accel_mps2) noexcept {
  std::array<Vec3, kFootCount> base_up_sole;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    base_up_sole[index_of(foot)] = base_T_sole(legs, foot, leg_joints(q_rad, foot)).R.col(2);
  }
  return {angle_rad(base_up_sole[0], base_up_sole[1]), angle_rad(base_accel_mps2, base_up_sole[0] + base_up_sole[1])};
}

}  // namespace polygmap
