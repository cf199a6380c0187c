// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/imu_noise.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

TEST(ImuNoise, WhiteNoiseOnMotion_IsMeasuredAtAnyRate) {
  for (const double rate_hz : {200.0, 500.0, 1000.0}) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    ImuNoise noise;
    noise.reset({});
    for (int i = 0; i < 5000; ++i) {
      const double t_s = i / rate_hz, swing = std::sin(2.0 * kPi * 1.5 * t_s);
      const auto draw = [&](double sigma) { return Vec3{sigma * normal(random), sigma * normal(random), swing}; };
      noise.update(static_cast<std::int64_t>(1e9 * t_s), 0.5 * draw(8e-3), 2.0 * draw(0.1) + Vec3{0, 0, kGravity_mps2});
    }
    const double two_of_three = std::sqrt(2.0 / 3.0);
    EXPECT_NEAR(noise.density().gyro_radprs * std::sqrt(rate_hz), two_of_three * 4e-3, 4e-4) << rate_hz;
    EXPECT_NEAR(noise.density().accel_mpsrs * std::sqrt(rate_hz), two_of_three * 0.2, 2e-2) << rate_hz;
  }
}

}  // namespace
}  // namespace polygmap
