// SPDX-License-Identifier: Apache-2.0
#include "algorithms/geometry/so3.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

TEST(So3, LogOfExp_AnglesUpToHalfATurn_ReturnsTheVector) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (const double angle : {1e-12, 1e-8, 1e-5, 1e-4, 1e-3, 0.1, 1.0, 2.0, 3.0, kPi - 1e-6, kPi - 1e-9}) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 v = angle * Vec3{normal(random), normal(random), normal(random)}.normalized();
      const Mat3 R = so3_exp(v);
      EXPECT_TRUE(is_rotation(R, 1e-12));
      ASSERT_LT((so3_log(R) - v).norm(), 1e-9 + 1e-12 / (kPi + 1e-7 - angle)) << angle;
    }
  }
}

TEST(So3, Renormalised_ProductsOfManyRotations_StayRotations) {
  Mat3 R = Mat3::Identity();
  for (int i = 0; i < (test::kSlowMachine ? 100000 : 1000000); ++i)
    R = so3_renormalised(R * so3_exp({1e-3, -2e-3, 3e-3}));
  EXPECT_TRUE(is_rotation(R, 1e-14));
}

}  // namespace
}  // namespace polygmap
