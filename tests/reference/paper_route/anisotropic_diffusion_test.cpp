// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/anisotropic_diffusion.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>

namespace polygmap {
namespace {

void diffuse(const AnisotropicDiffusion::Params& params, const DepthNoiseModel& noise, InverseDepthImage& image,
             std::int32_t width, std::int32_t height) {
  AnisotropicDiffusion diffusion;
  for (std::int32_t i = 0; i < params.iterations; ++i) {
    diffusion.begin_iteration();
    for (std::int32_t r = 0; r < height; ++r) diffusion.step_row(params, noise, image, r, width, height);
  }
}

TEST(AnisotropicDiffusion, Eq13_OneIteration_IsTheSumOverFourNeighboursOfOldValues) {
  constexpr std::int32_t kWidth = 12, kHeight = 9;
  const AnisotropicDiffusion::Params params{.iterations = 1, .lambda = 0.2, .kappa_sigmas = 4.0};
  const DepthNoiseModel noise;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0.9F, 1.1F);
  auto image = std::make_unique<InverseDepthImage>();
  for (std::int32_t r = 0; r < kHeight; ++r) {
    for (std::int32_t c = 0; c < kWidth; ++c) (*image)(c, r) = uniform(random);
  }
  (*image)(4, 4) = 0.0F;  // an empty pixel neither gives nor takes
  const auto old = std::make_unique<InverseDepthImage>(*image);
  diffuse(params, noise, *image, kWidth, kHeight);
  for (std::int32_t r = 0; r < kHeight; ++r) {
    for (std::int32_t c = 0; c < kWidth; ++c) {
      const double here = static_cast<double>((*old)(c, r));
      double sum = 0.0;
      for (const auto& [dc, dr] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (c + dc < 0 || c + dc >= kWidth || r + dr < 0 || r + dr >= kHeight) continue;
        const double there = static_cast<double>((*old)(c + dc, r + dr));
        if (here <= 0.0 || there <= 0.0) continue;
        const auto kappa = [&](double w) { return params.kappa_sigmas * noise.sigma_m(1.0 / w) * w * w; };
        const double conductivity = 1.0 / (1.0 + math::square(there - here) / (kappa(here) * kappa(there)));
        sum += conductivity * (there - here);
      }
      ASSERT_NEAR(static_cast<double>((*image)(c, r)), here + params.lambda * sum, 1e-6) << c << " " << r;
    }
  }
}

TEST(AnisotropicDiffusion, SlantedPlane_StaysWhatItIs) {
  auto image = std::make_unique<InverseDepthImage>();
  const auto plane = [](std::int32_t c, std::int32_t r) {
    return 1.2F + 0.001F * static_cast<float>(c) - 0.002F * static_cast<float>(r);
  };
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < kHalfWidth_px; ++c) (*image)(c, r) = plane(c, r);
  }
  diffuse({.iterations = 5}, {}, *image, kHalfWidth_px, kHalfHeight_px);
  for (std::int32_t r = 8; r < kHalfHeight_px - 8; r += 7) {
    for (std::int32_t c = 8; c < kHalfWidth_px - 8; c += 7) ASSERT_NEAR((*image)(c, r), plane(c, r), 2e-5F);
  }
}

TEST(AnisotropicDiffusion, NoisyStep_LosesNoiseAndKeepsTheStep) {
  auto image = std::make_unique<InverseDepthImage>();
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0.0F, 0.002F);
  for (std::int32_t r = 0; r < kHalfHeight_px; ++r) {
    for (std::int32_t c = 0; c < kHalfWidth_px; ++c) (*image)(c, r) = (c < 100 ? 1.25F : 1.0F) + noise(random);
  }
  diffuse({.iterations = 5}, {}, *image, kHalfWidth_px, kHalfHeight_px);
  double squares = 0.0;
  int n = 0;
  for (std::int32_t r = 20; r < 200; ++r) {
    for (std::int32_t c = 20; c < 80; ++c) {
      squares += math::square(static_cast<double>((*image)(c, r)) - 1.25);
      ++n;
    }
    ASSERT_NEAR((*image)(99, r), 1.25F, 0.006F);
    ASSERT_NEAR((*image)(100, r), 1.0F, 0.006F);
  }
  EXPECT_LT(std::sqrt(squares / n), 0.0009);
}

}  // namespace
}  // namespace polygmap
