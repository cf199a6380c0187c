// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/foot_motion.hpp"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/geometry/so3.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_s;

TEST(FootMotion, RestingFootWithNoise_IsRest_SlippingFootIsLetGo_AndTheNoiseIsMeasured) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 2e-3);
  FootMotion motion;
  motion.reset({});
  Vec3 before = Vec3::Zero();
  double slid_m = 0.0;
  const auto run = [&](int ticks, double speed_mps) {
    int let_go = 0;
    for (int i = 0; i < ticks; ++i) {
      slid_m += speed_mps * kTick_s;
      const Vec3 now{slid_m + noise(random), noise(random), noise(random)};
      motion.update(0, now - before, 0.005, true, kTick_s);
      before = now;
      let_go += motion.walk_m2ps(0) > 0.0 ? 1 : 0;
    }
    return let_go;
  };
  run(500, 0.0);
  EXPECT_EQ(run(1000, 0.0), 0);
  EXPECT_NEAR(motion.position_sigma_m(), 2e-3, 3e-4);
  EXPECT_GT(run(100, 0.3), 60);  // of 0.2 s
  run(100, 0.0);
  EXPECT_EQ(run(100, 0.0), 0);
}

}  // namespace
}  // namespace polygmap
