// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/plane_ransac.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/support/plane_samples.hpp"

namespace polygmap {
namespace {

using test::kSampleNoise;
using test::sample_plane;

bool fit(const std::vector<PlaneSample>& samples, Lean lean, const Vec3& up, InversePlane& plane, std::int32_t& inliers,
         std::int32_t* trials = nullptr) {
  PlaneRansac ransac;
  ransac.begin(5, samples);
  while (!ransac.step({}, kSampleNoise, lean, up)) {
  }
  if (trials != nullptr) *trials = ransac.trials();
  return ransac.try_finish({}, kSampleNoise, lean, up, plane, inliers);
}

TEST(PlaneRansac, ThirtyPercentOutliers_FindsThePlane) {
  const Vec3 normal = Vec3{0.05, -0.5, -0.86}.normalized();
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    InversePlane plane;
    std::int32_t inliers = 0;
    ASSERT_TRUE(fit(sample_plane(normal, 0.7, 256, 0.3, seed), Lean::kLevel, normal, plane, inliers));
    EXPECT_LT(math::acos(std::min(1.0, plane.normal().dot(normal))), 0.01) << seed;
    EXPECT_NEAR(plane.d_m(), 0.7, 0.002) << seed;
    EXPECT_GT(inliers, 150) << seed;
  }
}

TEST(PlaneRansac, NarrowStrip_TakesItsTiltFromGravity) {
  const Vec3 normal = Vec3{0.0, -0.5, -0.866}.normalized();
  std::vector<PlaneSample> samples = sample_plane(normal, 0.7, 200, 0.0, 3);
  const InversePlane truth{-normal / 0.7};
  std::mt19937 random(9);
  std::normal_distribution<> gauss;
  for (PlaneSample& s : samples) {
    s.y = 0.01F * s.y;
    const Vec3 ray{static_cast<double>(s.x), static_cast<double>(s.y), 1.0};
    s.w = static_cast<float>(truth.inverse_depth(ray) + gauss(random) * inverse_depth_sigma(kSampleNoise, truth, ray));
  }
  InversePlane plane;
  std::int32_t inliers = 0;
  ASSERT_TRUE(fit(samples, Lean::kLevel, normal, plane, inliers));
  EXPECT_LT(math::acos(std::min(1.0, plane.normal().dot(normal))), 0.02);
}

TEST(PlaneRansac, WrongLeanOrTooFewSamples_FindsNothing) {
  const Vec3 normal = Vec3{0.0, -0.5, -0.866}.normalized();
  InversePlane plane;
  std::int32_t inliers = 0;
  EXPECT_FALSE(fit(sample_plane(normal, 0.7, 256, 0.0, 1), Lean::kUpright, normal, plane, inliers));
  EXPECT_FALSE(fit(sample_plane(normal, 0.7, 2, 0.0, 1), Lean::kAny, normal, plane, inliers));
  const std::vector<PlaneSample> same(100, {0.1F, 0.1F, 1.0F});
  EXPECT_FALSE(fit(same, Lean::kAny, normal, plane, inliers));
}

TEST(PlaneRansac, CleanData_StopsEarlyAndRepeatsExactly) {
  const Vec3 normal = Vec3{0.0, -0.5, -0.866}.normalized();
  const std::vector<PlaneSample> samples = sample_plane(normal, 0.7, 256, 0.0, 1);
  InversePlane a, b;
  std::int32_t inliers = 0, trials = 0;
  ASSERT_TRUE(fit(samples, Lean::kLevel, normal, a, inliers, &trials));
  EXPECT_LT(trials, PlaneRansac::Params{}.trials);
  ASSERT_TRUE(fit(samples, Lean::kLevel, normal, b, inliers));
  EXPECT_EQ(a.m, b.m);
}

}  // namespace
}  // namespace polygmap
