// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/lio_uncertainty.hpp"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/geometry/so3.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

TEST(LioUncertainty, BlendsWithoutDrift_LetThroughWhatALowPassOfWhiteNoiseDoes) {
  LioUncertainty uncertainty;
  uncertainty.reset({});
  const double gain = 0.1;
  for (int i = 0; i < 500; ++i) uncertainty.blend(gain, 0.01, 0.002);
  EXPECT_NEAR(uncertainty.offset_variance().x(), 1e-4 * gain / (2.0 - gain), 1e-12);
  EXPECT_NEAR(uncertainty.offset_variance()[3], 4e-6 * gain / (2.0 - gain), 1e-14);
}

TEST(LioUncertainty, DriftUnderBlends_LagsByTheTimeConstant) {
  LioUncertainty uncertainty;
  const LioUncertainty::Params params;
  uncertainty.reset(params);
  for (int i = 0; i < 2000; ++i) {
    uncertainty.move({0, 0, 0.02});  // up: no heading bends that
    uncertainty.blend(0.1, 0.0, 0.0);
  }
  EXPECT_NEAR(std::sqrt(uncertainty.offset_variance().z()), params.drift_per_m * 0.02 * 0.9 / 0.1, 1e-9);
}

TEST(LioUncertainty, Tie_AtThatMomentChangesNothing) {
  LioUncertainty uncertainty;
  uncertainty.reset({});
  for (int i = 0; i < 100; ++i) uncertainty.move({0.02, 0.01, 0.005});
  const Vec3 there_m{2.0, 1.0, 0.5}, before_m = uncertainty.position_sigma_m(there_m);
  const double yaw_rad = uncertainty.yaw_sigma_rad();
  LioUncertainty::Quantities known;
  known << uncertainty.position_sigma_m(there_m).cwiseAbs2(), math::square(uncertainty.yaw_sigma_rad());
  uncertainty.tie(there_m, 0.01, 0.003, known);
  EXPECT_LT((uncertainty.position_sigma_m(there_m) - before_m).norm(), 1e-12);
  EXPECT_NEAR(uncertainty.yaw_sigma_rad(), yaw_rad, 1e-12);
  for (int i = 0; i < 500; ++i) uncertainty.blend(0.1, 0.0, 0.0);  // what is forgotten no longer cancels it
  EXPECT_NEAR(uncertainty.position_sigma_m(there_m).x(), std::hypot(before_m.x(), 0.01), 1e-9);
}

// What the odometry's filter takes back, because a foot stands firmly again, is not counted twice when it grows anew.
TEST(LioUncertainty, OdometrysVariance_GrowsAndShrinks_IsFollowed) {
  using Quantities = LioUncertainty::Quantities;
  LioUncertainty uncertainty;
  uncertainty.reset({});
  uncertainty.begin(Quantities::Constant(1e-6));
  for (int i = 0; i < 10; ++i) {
    uncertainty.follow(Quantities::Constant(5e-6));
    EXPECT_NEAR(uncertainty.offset_variance()[2], 4e-6, 1e-15);
    uncertainty.follow(Quantities::Constant(2e-6));
    EXPECT_NEAR(uncertainty.offset_variance()[2], 1e-6, 1e-15);
  }
  uncertainty.blend(0.5, 0.0, 0.0);  // LIO knows better: what shrinks then is gone already
  uncertainty.follow(Quantities::Constant(1e-6));
  EXPECT_EQ(uncertainty.offset_variance()[2], 0.0);
}

}  // namespace
}  // namespace polygmap
