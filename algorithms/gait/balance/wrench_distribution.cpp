// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/wrench_distribution.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace polygmap {

namespace {

// Where each sole carries its share without any turning of its own: both, a little inward of their middles.
struct Carriers {
  std::array<Vec3, kFootCount> odom_p_m;
  [[nodiscard]] double height_m(double share) const noexcept {
    return odom_p_m[1].z() + share * (odom_p_m[0].z() - odom_p_m[1].z());
  }
};

// Of the left sole's share of the force: what remains of the line's place there goes to the centres of pressure. Also
// by how much they miss it.
Pressure press(const Support& support, const PressureLimits& limits, const Carriers& carriers, double share,
               const Vec2& line_m, double& missed_m) noexcept {
  Pressure pressure;
  pressure.share = {share, 1.0 - share};
  const Vec2 rest_m = line_m - (share * carriers.odom_p_m[0] + (1.0 - share) * carriers.odom_p_m[1]).head<2>();
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const Transform& sole = support.odom_T_sole[f];
    const Vec3 carried_m = carriers.odom_p_m[f] - sole.p_m;
    const Vec3 local_m = sole.R.transpose() * Vec3{carried_m.x() + rest_m.x(), carried_m.y() + rest_m.y(), 0.0};
    const double ahead_m = std::min(limits.ahead_m / std::max(pressure.share[f], 1e-3), limits.toe_m);
    const double along_m = support.on_toe[f] ? support.toe_x_m : math::clamp(local_m.x(), -limits.behind_m, ahead_m);
    pressure.centre_m[f] = sole * Vec3{along_m, math::clamp(local_m.y(), -limits.aside_m, limits.aside_m), 0.0};
    pressure.zmp_m += pressure.share[f] * pressure.centre_m[f];
  }
  missed_m = (pressure.zmp_m.head<2>() - line_m).norm();
  return pressure;
}

}  // namespace

Pressure distribute(const Support& support, const PressureLimits& limits, const Vec3& odom_p_com_m,
                    const Vec2& slope) noexcept {
  Carriers carriers{{support.odom_p_carrier_m(0), support.odom_p_carrier_m(1)}};
  const bool both = support.stands[0] && support.stands[1];
  if (both) {
    carriers.odom_p_m[0] -= limits.inward_m * support.odom_T_sole[0].R.col(1);
    carriers.odom_p_m[1] += limits.inward_m * support.odom_T_sole[1].R.col(1);
  }
  const auto line_at = [&](double share) -> Vec2 {
    return odom_p_com_m.head<2>() - (odom_p_com_m.z() - carriers.height_m(share)) * slope;
  };
  double missed_m = 0.0;
  const auto press_with = [&](double share, double& missed) {
    return press(support, limits, carriers, share, line_at(share), missed);
  };
  if (!both) return press_with(support.stands[0] ? 1.0 : 0.0, missed_m);

  constexpr int kPasses = 3;  // the ground's height under the line depends on the shares
  const Vec2 right_m = carriers.odom_p_m[1].head<2>(), between_m = carriers.odom_p_m[0].head<2>() - right_m;
  double share = 0.5;
  for (int i = 0; i < kPasses; ++i) {
    const Vec2 off_m = line_at(share) - right_m;
    share = math::clamp(off_m.dot(between_m) / std::max(between_m.squaredNorm(), 1e-6), 0.0, 1.0);
  }
  Pressure pressure = press_with(share, missed_m);
  if (missed_m < limits.missed_m) return pressure;
  // Beyond the soles' limits with these shares: with those that come closest, where that gains anything.
  double least_m = missed_m - limits.gained_m, low = 0.0, high = 1.0;
  constexpr int kThirds = 8;  // each leaves two thirds: 4 % of the shares
  for (int i = 0; i < kThirds; ++i) {
    const double third = (high - low) / 3.0;
    std::array<double, 2> tried_m{};
    const std::array<Pressure, 2> tried{press_with(low + third, tried_m[0]), press_with(high - third, tried_m[1])};
    const std::size_t closer = tried_m[1] < tried_m[0] ? 1 : 0;
    if (tried_m[closer] < least_m) {
      least_m = tried_m[closer];
      pressure = tried[closer];
    }
    (closer == 1 ? low : high) = closer == 1 ? low + third : high - third;
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
