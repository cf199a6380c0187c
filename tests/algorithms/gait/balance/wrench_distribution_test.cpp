// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/wrench_distribution.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

Support standing(double left_z_m = 0.0) {
  Support support;
  support.odom_T_sole[0].p_m = {0.0, 0.1, left_z_m};
  support.odom_T_sole[1].p_m = {0.0, -0.1, 0.0};
  return support;
}

TEST(WrenchDistribution, ForceBetweenTheSoles_IsSharedByPlace) {
  const Pressure middle = distribute(standing(), {}, {0, 0, 0.8}, Vec2::Zero());
  EXPECT_NEAR(middle.share[0], 0.5, 1e-12);
  EXPECT_LT(middle.zmp_m.head<2>().norm(), 1e-12);
  const Pressure left = distribute(standing(), {}, {0, 0.08, 0.8}, Vec2::Zero());
  EXPECT_EQ(left.share[0], 1.0);  // 30 mm inward of the left sole's middle line it carries everything
  EXPECT_NEAR(left.zmp_m.y(), 0.08, 1e-12);
}

TEST(WrenchDistribution, SoleOnItsToe_IsPressedAtItsEdgeAlone) {
  Support support = standing();
  support.on_toe[0] = true;
  support.toe_x_m = kContactRectangle.toe_x_m;
  const Pressure pressure = distribute(support, {}, {0.1, 0.0, 0.8}, Vec2::Zero());
  EXPECT_NEAR(pressure.centre_m[0].x(), kContactRectangle.toe_x_m, 1e-12);
  EXPECT_GT(pressure.share[0], 0.3);
}

TEST(WrenchDistribution, WrenchesOfBothSoles_AddUpToTheForceThroughTheCentreOfMass) {
  const Support support = standing(0.13);
  const Vec3 com_m{0.02, 0.03, 0.9};
  const Vec2 slope{0.02, -0.03};
  const Pressure pressure = distribute(support, {}, com_m, slope);
  const Vec3 force_n{540 * slope.x(), 540 * slope.y(), 540};
  Vec3 sum_n = Vec3::Zero(), moment_nm = Vec3::Zero();
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const SoleWrench wrench = sole_wrench(pressure, support, foot, force_n, Mat3::Identity());
    sum_n += wrench.force_n;
    moment_nm += wrench.moment_nm + (support.odom_T_sole[index_of(foot)].p_m - com_m).cross(wrench.force_n);
  }
  EXPECT_LT((sum_n - force_n).norm(), 1e-9);
  EXPECT_LT(moment_nm.norm(), 1.0);  // feet at two heights: the line meets their connection within 2 mm
}

TEST(WrenchDistribution, ForceBeyondTheSole_StopsAtItsLimits) {
  Support support = standing();
  support.stands = {true, false};
  const PressureLimits limits;
  const Pressure far = distribute(support, limits, {0.3, 0.3, 0.8}, Vec2::Zero());
  EXPECT_EQ(far.share[0], 1.0);
  EXPECT_NEAR(far.zmp_m.x(), limits.ahead_m, 1e-12);
  EXPECT_NEAR(far.zmp_m.y(), 0.1 + limits.aside_m, 1e-12);
  const Pressure behind = distribute(support, limits, {-0.3, -0.3, 0.8}, Vec2::Zero());
  EXPECT_NEAR(behind.zmp_m.x(), -limits.behind_m, 1e-12);
  EXPECT_NEAR(behind.zmp_m.y(), 0.1 - limits.aside_m, 1e-12);
}

// What the ankles hold is a torque: of half the force at twice the distance.
TEST(WrenchDistribution, ForceFarAheadOfTwoSoles_IsPressedTwiceAsFarAheadAsOfOne) {
  const PressureLimits limits;
  const Pressure half = distribute(standing(), limits, {0.12, 0.0, 0.8}, Vec2::Zero());
  EXPECT_NEAR(half.zmp_m.x(), 0.12, 1e-9);
  EXPECT_NEAR(half.share[0], 0.5, 1e-9);
  const Pressure far = distribute(standing(), limits, {0.3, 0.0, 0.8}, Vec2::Zero());
  for (std::size_t f = 0; f < kFootCount; ++f) {
    EXPECT_LE(far.share[f] * far.centre_m[f].x(), limits.ahead_m + 1e-9);
    EXPECT_LE(far.centre_m[f].x(), limits.toe_m + 1e-9);
  }
  EXPECT_GT(far.zmp_m.x(), 1.9 * limits.ahead_m);
  PressureLimits short_soles;
  short_soles.toe_m = 0.1;
  EXPECT_NEAR(distribute(standing(), short_soles, {0.3, 0.0, 0.8}, Vec2::Zero()).zmp_m.x(), 0.1, 1e-9);
}

// Of all shares, with what remains pressed within both soles: how close to a vertical line through the point they come.
double closest_m(const Support& support, const PressureLimits& limits, const Vec2& line_m) {
  double closest = 1e3;
  const std::array side{1.0, -1.0};
  std::array<Vec2, kFootCount> carrier_m;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    carrier_m[f] = support.odom_T_sole[f].p_m.head<2>() - Vec2{0.0, side[f] * limits.inward_m};
  }
  for (int i = 0; i <= 1000; ++i) {
    const std::array share{1e-3 * i, 1.0 - 1e-3 * i};
    const Vec2 rest_m = line_m - share[0] * carrier_m[0] - share[1] * carrier_m[1];
    Vec2 zmp_m = Vec2::Zero();
    for (std::size_t f = 0; f < kFootCount; ++f) {
      const Vec2 local_m = rest_m - Vec2{0.0, side[f] * limits.inward_m};
      const double ahead_m = std::min(limits.ahead_m / std::max(share[f], 1e-3), limits.toe_m);
      zmp_m += share[f] *
               (support.odom_T_sole[f].p_m.head<2>() + Vec2{math::clamp(local_m.x(), -limits.behind_m, ahead_m),
                                                            math::clamp(local_m.y(), -limits.aside_m, limits.aside_m)});
    }
    closest = std::min(closest, (zmp_m - line_m).norm());
  }
  return closest;
}

// One foot on the next tread: sideways the soles' hull is narrow, and shares by the place between them give up ground.
TEST(WrenchDistribution, ForceBeyondBothSoles_ComesAboutAsCloseAsAnyShares) {
  Support support = standing();
  support.odom_T_sole[0].p_m = {-0.28, 0.1, -0.13};
  const PressureLimits limits;
  double most_m = 0.0;
  for (double x_m = -0.4; x_m < 0.15; x_m += 0.05) {
    for (double y_m = -0.2; y_m < 0.25; y_m += 0.05) {
      const Vec2 line_m{x_m, y_m};
      const Pressure pressure = distribute(support, limits, {x_m, y_m, 0.8}, Vec2::Zero());
      most_m = std::max(most_m, closest_m(support, limits, line_m));
      EXPECT_LT((pressure.zmp_m.head<2>() - line_m).norm(), closest_m(support, limits, line_m) + 0.007) << line_m;
    }
  }
  EXPECT_GT(most_m, 0.1);
  const Vec2 pushed_m{0.03, 0.02};
  EXPECT_LT((distribute(support, limits, {0.03, 0.02, 0.8}, Vec2::Zero()).zmp_m.head<2>() - pushed_m).norm(),
            closest_m(support, limits, pushed_m) + 0.001);
}

}  // namespace
}  // namespace polygmap
