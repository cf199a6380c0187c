// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/back_projection.hpp"

#include <gtest/gtest.h>

#include "algorithms/perception/images.hpp"

namespace polygmap {
namespace {

TEST(BackProjection, Eq11_RobotCamera_IsThePinholeFormula) {
  const CameraIntrinsics k{640, 480, 366.7, 366.8, 322.7, 242.3, 0.00025};
  const Vec3 p = back_project(k, 400.0, 100.0, 0.8);
  EXPECT_NEAR(p.x(), (400.0 - 322.7) * 0.8 / 366.7, 1e-12);
  EXPECT_NEAR(p.y(), (100.0 - 242.3) * 0.8 / 366.8, 1e-12);
  EXPECT_NEAR(p.z(), 0.8, 1e-12);
  // A half-resolution pixel sees along the middle of its four.
  HalfRays rays;
  rays.set(k);
  EXPECT_LT((rays.ray(200, 50) * 0.8 - back_project(k, 400.5, 100.5, 0.8)).norm(), 1e-12);
}

}  // namespace
}  // namespace polygmap
