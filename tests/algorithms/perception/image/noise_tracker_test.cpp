// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/noise_tracker.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <random>

namespace polygmap {
namespace {

constexpr DepthNoiseModel kProfile;

// What rows at these depths show when their noise is `truth` and the model believes `believed`.
NoiseSamples samples_of(const DepthNoiseModel& truth, const DepthNoiseModel& believed,
                        std::initializer_list<double> depths_m, int rows = 2000) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  NoiseSamples samples;
  for (const double z_m : depths_m) {
    for (int i = 0; i < rows; ++i) {
      const double sigmas = normal(random) * truth.sigma_m(z_m) / believed.sigma_m(z_m);
      samples.add(static_cast<float>(1.0 / z_m), static_cast<float>(sigmas * sigmas));
    }
  }
  return samples;
}

DepthNoiseModel settle(const DepthNoiseModel& truth, const NoiseTracker::Params& params,
                       std::initializer_list<double> depths_m) {
  NoiseTracker noise;
  for (int i = 0; i < 60; ++i) noise.follow(params, kProfile, samples_of(truth, noise.of(kProfile), depths_m));
  return noise.of(kProfile);
}

TEST(NoiseTracker, NoiseThatGrowsWithTheSquare_IsFollowedAtEveryDepth) {
  const DepthNoiseModel stereo{0.001, 0.0, 0.004}, believed = settle(stereo, {}, {0.8, 1.2, 2.0, 3.0, 5.0});
  for (const double z_m : {2.0, 3.0, 5.0}) {
    EXPECT_NEAR(believed.sigma_m(z_m) / stereo.sigma_m(z_m), 1.0, 0.15) << z_m;
  }
  EXPECT_LT(believed.sigma_m(0.8), 1.5 * stereo.sigma_m(0.8));
}

TEST(NoiseTracker, NoiseTwiceTheProfile_IsAFactorAndNoSquare) {
  const DepthNoiseModel believed = settle(kProfile.scaled(2.0), {}, {0.8, 1.2, 2.0, 3.0});
  for (const double z_m : {0.5, 1.0, 3.0, 6.0}) {
    EXPECT_NEAR(believed.sigma_m(z_m) / kProfile.sigma_m(z_m), 2.0, 0.2) << z_m;
  }
}

TEST(NoiseTracker, OneDepth_SaysNothingOfOthers) {
  const DepthNoiseModel believed = settle(kProfile.scaled(1.5), {}, {2.0});
  EXPECT_NEAR(believed.sigma_m(6.0) / kProfile.sigma_m(6.0), 1.5, 0.1);
}

TEST(NoiseTracker, Bounds_AreHeld) {
  const NoiseTracker::Params params;
  const DepthNoiseModel quiet = settle(kProfile.scaled(0.2), params, {0.8, 2.0, 4.0});
  EXPECT_EQ(quiet.sigma_m(1.0), kProfile.sigma_m(1.0));
  EXPECT_EQ(quiet.sigma_m(4.0), kProfile.sigma_m(4.0));
  const DepthNoiseModel loud = settle(DepthNoiseModel{0.05, 0.05, 0.05}, params, {0.8, 2.0, 4.0});
  EXPECT_LE(loud.sigma_m(3.0), params.max_scale * kProfile.sigma_m(3.0) + 9.0 * params.max_quadratic_per_m + 1e-12);
}

TEST(NoiseTracker, FewRows_AreNotBelieved) {
  NoiseTracker noise;
  noise.follow({}, kProfile, samples_of(kProfile.scaled(3.0), kProfile, {1.0, 2.0}, 20));
  EXPECT_EQ(noise.of(kProfile).sigma_m(2.0), kProfile.sigma_m(2.0));
}

TEST(NoiseTracker, OneFrame_MovesItByTheGain) {
  NoiseTracker noise;
  noise.follow({.gain = 0.1}, kProfile, samples_of(kProfile.scaled(3.0), kProfile, {2.0}));
  EXPECT_NEAR(noise.of(kProfile).sigma_m(2.0) / kProfile.sigma_m(2.0), 1.2, 0.05);
}

}  // namespace
}  // namespace polygmap
