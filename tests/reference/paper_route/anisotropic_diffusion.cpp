// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/anisotropic_diffusion.hpp"

#include <cmath>

namespace polygmap {
namespace {

// c(difference) times difference, from a to b. Kappa in inverse depth is kappa_z w^2 with kappa_z = k (base + per z),
// squared and shared by both: it vanishes with either pixel, so that an empty one conducts nothing, without a branch.
// (A quadratic term would not vanish: it is left out.)
inline float flux(float a, float b, float base, float per_metre) noexcept {
  const float kappa2 = (base * a + per_metre) * (base * b + per_metre) * a * b;
  const float difference = a - b;
  return difference * kappa2 / (kappa2 + difference * difference + 1e-20F);
}

// As published: exp(-(depth difference / kappa)^2).
inline float published_flux(float a, float b, float kappa_m) noexcept {
  if (a <= 0.0F || b <= 0.0F) return 0.0F;
  const float difference = a - b, ratio = difference / (a * b * kappa_m);
  return difference * static_cast<float>(std::exp(-static_cast<double>(ratio * ratio)));
}

}  // namespace

void AnisotropicDiffusion::step_row(const Params& params, const DepthNoiseModel& noise, InverseDepthImage& image,
                                    std::int32_t row, std::int32_t width_px, std::int32_t height_px) noexcept {
  const auto base = static_cast<float>(params.kappa_sigmas * noise.base_m);
  const auto per_metre = static_cast<float>(params.kappa_sigmas * noise.per_metre);
  const auto lambda = static_cast<float>(math::clamp(params.lambda, 0.0, 0.25));
  const auto kappa_m = static_cast<float>(params.kappa_m);
  const auto between = [&](float a, float b) noexcept {
    return kappa_m > 0.0F ? published_flux(a, b, kappa_m) : flux(a, b, base, per_metre);
  };
  float* w = image.row(row);
  float* above = flux_above_.data();
  float* left = flux_left_.data();
  float* below = flux_below_.data();
  left[0] = 0.0F;
  for (std::int32_t i = 1; i < width_px; ++i) left[i] = between(w[i - 1], w[i]);
  left[width_px] = 0.0F;
  if (row + 1 < height_px) {
    const float* next = image.row(row + 1);
    for (std::int32_t i = 0; i < width_px; ++i) below[i] = between(w[i], next[i]);
  } else {
    flux_below_.fill(0.0F);
  }
  for (std::int32_t i = 0; i < width_px; ++i) {
    w[i] += lambda * ((left[i] - left[i + 1]) + (above[i] - below[i]));
    above[i] = below[i];
  }
}

}  // namespace polygmap
