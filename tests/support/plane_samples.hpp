// SPDX-License-Identifier: Apache-2.0
// Noisy pixels of one plane, for the tests of its fits.
#pragma once

#include <random>
#include <vector>

#include "tests/reference/paper_route/plane_ransac.hpp"

namespace polygmap::test {

inline constexpr DepthNoiseModel kSampleNoise;

// Rays up to half_field from the optical axis; a share outliers of them measures anything between 0.5 and 1.5 / m.
[[nodiscard]] inline std::vector<PlaneSample> sample_plane(const Vec3& normal, double d_m, std::size_t count,
                                                           double outliers, std::uint32_t seed,
                                                           double half_field = 0.3) {
  std::mt19937 random(seed);
  std::normal_distribution<> gauss;
  std::uniform_real_distribution<> uniform(-1.0, 1.0);
  std::vector<PlaneSample> samples;
  const InversePlane plane{-normal / d_m};
  while (samples.size() < count) {
    const Vec3 ray{half_field * uniform(random), half_field * uniform(random), 1.0};
    double w = plane.inverse_depth(ray);
    if (w < 0.2) continue;
    w += gauss(random) * inverse_depth_sigma(kSampleNoise, plane, ray);
    if (uniform(random) < 2.0 * outliers - 1.0) w = 1.0 + 0.5 * uniform(random);
    samples.push_back({static_cast<float>(ray.x()), static_cast<float>(ray.y()), static_cast<float>(w)});
  }
  return samples;
}

}  // namespace polygmap::test
