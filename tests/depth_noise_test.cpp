// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/depth_noise.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <random>

namespace polygmap {
namespace {

constexpr DepthSigma kProfile;

// What rows at these depths show when their noise is `truth` and the model believes `believed`.
NoiseSamples samples_of(const DepthSigma& truth, const DepthSigma& believed, std::initializer_list<double> depths_m,
                        int rows = 2000) {
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

DepthSigma settle(const DepthSigma& truth, const DepthNoise::Params& params, std::initializer_list<double> depths_m) {
  DepthNoise noise;
  for (int i = 0; i < 60; ++i) noise.follow(params, kProfile, samples_of(truth, noise.of(kProfile), depths_m));
  return noise.of(kProfile);
}

TEST(DepthNoise, NoiseThatGrowsWithTheSquare_IsFollowedAtEveryDepth) {
  const DepthSigma stereo{0.001, 0.0, 0.004}, believed = settle(stereo, {}, {0.8, 1.2, 2.0, 3.0, 5.0});
  for (const double z_m : {2.0, 3.0, 5.0}) {
    EXPECT_NEAR(believed.sigma_m(z_m) / stereo.sigma_m(z_m), 1.0, 0.15) << z_m;
  }
  EXPECT_LT(believed.sigma_m(0.8), 1.5 * stereo.sigma_m(0.8));
}

TEST(DepthNoise, NoiseTwiceTheProfile_IsAFactorAndNoSquare) {
  const DepthSigma believed = settle(kProfile.scaled(2.0), {}, {0.8, 1.2, 2.0, 3.0});
  for (const double z_m : {0.5, 1.0, 3.0, 6.0}) {
    EXPECT_NEAR(believed.sigma_m(z_m) / kProfile.sigma_m(z_m), 2.0, 0.2) << z_m;
  }
}

TEST(DepthNoise, OneDepth_SaysNothingOfOthers) {
  const DepthSigma believed = settle(kProfile.scaled(1.5), {}, {2.0});
  EXPECT_NEAR(believed.sigma_m(6.0) / kProfile.sigma_m(6.0), 1.5, 0.1);
}

TEST(DepthNoise, Bounds_AreHeld) {
  const DepthNoise::Params params;
  const DepthSigma quiet = settle(kProfile.scaled(0.2), params, {0.8, 2.0, 4.0});
  EXPECT_EQ(quiet.sigma_m(1.0), kProfile.sigma_m(1.0));
  EXPECT_EQ(quiet.sigma_m(4.0), kProfile.sigma_m(4.0));
  const DepthSigma loud = settle(DepthSigma{0.05, 0.05, 0.05}, params, {0.8, 2.0, 4.0});
  EXPECT_LE(loud.sigma_m(3.0), params.max_scale * kProfile.sigma_m(3.0) + 9.0 * params.max_quadratic_per_m + 1e-12);
}

TEST(DepthNoise, FewRows_AreNotBelieved) {
  DepthNoise noise;
  noise.follow({}, kProfile, samples_of(kProfile.scaled(3.0), kProfile, {1.0, 2.0}, 20));
  EXPECT_EQ(noise.of(kProfile).sigma_m(2.0), kProfile.sigma_m(2.0));
}

TEST(DepthNoise, OneFrame_MovesItByTheGain) {
  DepthNoise noise;
  noise.follow({.gain = 0.1}, kProfile, samples_of(kProfile.scaled(3.0), kProfile, {2.0}));
  EXPECT_NEAR(noise.of(kProfile).sigma_m(2.0) / kProfile.sigma_m(2.0), 1.2, 0.05);
}

}  // namespace
}  // namespace polygmap
