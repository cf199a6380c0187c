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

}  // namespace
}  // namespace polygmap
