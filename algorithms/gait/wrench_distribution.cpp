// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/wrench_distribution.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace polygmap {

Pressure distribute(const Support& support, const PressureLimits& limits, const Vec3& odom_p_com_m,
                    const Vec2& slope) noexcept {
  Vec3 left = support.odom_T_sole[0].p_m, right = support.odom_T_sole[1].p_m;
  if (support.stands[0] && support.stands[1]) {
    left -= limits.inward_m * support.odom_T_sole[0].R.col(1);
    right += limits.inward_m * support.odom_T_sole[1].R.col(1);
  }
  const auto line_at = [&](double z_m) -> Vec2 { return odom_p_com_m.head<2>() - (odom_p_com_m.z() - z_m) * slope; };

  Pressure pressure;
  double share = support.stands[0] ? 1.0 : 0.0;  // of the left foot
  if (support.stands[0] && support.stands[1]) {
    constexpr int kPasses = 3;  // the ground's height under the line depends on the shares
    const Vec2 between = (left - right).head<2>();
    share = 0.5;
    for (int i = 0; i < kPasses; ++i) {
      const Vec2 off = line_at(right.z() + share * (left.z() - right.z())) - right.head<2>();
      share = math::clamp(off.dot(between) / std::max(between.squaredNorm(), 1e-6), 0.0, 1.0);
    }
  }
  pressure.share = {share, 1.0 - share};
  const double ground_m = right.z() + share * (left.z() - right.z());
  const Vec2 rest_m = line_at(ground_m) - (share * left + (1.0 - share) * right).head<2>();
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const Transform& sole = support.odom_T_sole[f];
    const Vec3 carried_m = (f == 0 ? left : right) - sole.p_m;
    const Vec3 local_m = sole.R.transpose() * Vec3{carried_m.x() + rest_m.x(), carried_m.y() + rest_m.y(), 0.0};
    pressure.centre_m[f] = sole * Vec3{math::clamp(local_m.x(), -limits.behind_m, limits.ahead_m),
                                       math::clamp(local_m.y(), -limits.aside_m, limits.aside_m), 0.0};
    pressure.zmp_m += pressure.share[f] * pressure.centre_m[f];
  }
  return pressure;
}

SoleWrench sole_wrench(const Pressure& pressure, const Support& support, Foot foot, const Vec3& force_n,
                       const Mat3& odom_R_base) noexcept {
  const std::size_t f = index_of(foot);
  const Vec3 part_n = pressure.share[f] * force_n;
  const Vec3 moment_nm = (pressure.centre_m[f] - support.odom_T_sole[f].p_m).cross(part_n);
  return {odom_R_base.transpose() * part_n, odom_R_base.transpose() * moment_nm};
}

}  // namespace polygmap
