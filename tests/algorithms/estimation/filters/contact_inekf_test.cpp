// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/filters/contact_inekf.hpp"

#include <gtest/gtest.h>

#include "algorithms/geometry/so3.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_s;

TEST(ContactInEkf, SilentImu_TiltAndYawGetUnsureAsNobodyFeelsThem) {
  ContactInEkf filter;
  filter.reset({});
  filter.initialise({}, {});
  const Vec3 rest_mps2{0, 0, kGravity_mps2};
  for (int i = 0; i < 50; ++i) filter.predict(Vec3::Zero(), rest_mps2, kTick_s, ContactInEkf::Motion::kFelt);
  EXPECT_LT(filter.yaw_sigma_rad(), 1e-3);
  for (int i = 0; i < 50; ++i) filter.predict(Vec3::Zero(), rest_mps2, kTick_s, ContactInEkf::Motion::kUnfelt);
  EXPECT_NEAR(filter.yaw_sigma_rad(), 0.1 * std::sqrt(0.1), 1e-3);
  EXPECT_NEAR(filter.tilt_sigma_rad(), 0.1 * std::sqrt(0.1), 1e-3);
}

TEST(ContactInEkf, AccelerationThatChangesBetweenSamples_VelocityGetsUnsureByItsShareOfTheChange) {
  constexpr double kPeriod_s = 0.02, kChange_mps2 = 3.0;
  const auto velocity_m2ps2 = [&](double share, double change_mps2) {
    ContactInEkf::Params params;
    params.accel_noise_rs = 0.0;
    params.accel_step_share = share;
    ContactInEkf filter;
    filter.reset(params);
    const Vec3 rest_mps2{0, 0, kGravity_mps2};
    filter.initialise({}, {}, Vec3::Zero(), rest_mps2);
    for (int i = 1; i <= 50; ++i) {
      const Vec3 felt_mps2 = rest_mps2 + Vec3{i % 2 * change_mps2, 0, 0};
      filter.predict(Vec3::Zero(), felt_mps2, kPeriod_s, ContactInEkf::Motion::kFelt);
      EXPECT_NEAR(filter.accel_step_mps2().norm(), change_mps2, 1e-12);
    }
    return filter.covariance()(3, 3);
  };
  const double steady_m2ps2 = velocity_m2ps2(0.5, 0.0);
  EXPECT_NEAR(velocity_m2ps2(0.0, kChange_mps2), steady_m2ps2, 1e-9);
  const double expected_m2ps2 = 50 * 0.25 * math::square(kChange_mps2 * kPeriod_s) / 3.0;
  EXPECT_NEAR(velocity_m2ps2(0.5, kChange_mps2) - steady_m2ps2, expected_m2ps2, 0.01 * expected_m2ps2);
}

}  // namespace
}  // namespace polygmap
