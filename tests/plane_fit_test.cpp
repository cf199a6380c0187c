// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/plane_fit.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace polygmap {
namespace {

constexpr DepthSigma kNoise;

std::vector<PlaneSample> sample_plane(const Vec3& normal, double d_m, std::size_t count, double outliers,
                                      std::uint32_t seed, double half_field = 0.3) {
  std::mt19937 random(seed);
  std::normal_distribution<> gauss;
  std::uniform_real_distribution<> uniform(-1.0, 1.0);
  std::vector<PlaneSample> samples;
  const InversePlane plane{-normal / d_m};
  while (samples.size() < count) {
    const Vec3 ray{half_field * uniform(random), half_field * uniform(random), 1.0};
    double w = plane.inverse_depth(ray);
    if (w < 0.2) continue;
    w += gauss(random) * inverse_depth_sigma(kNoise, plane, ray);
    if (uniform(random) < 2.0 * outliers - 1.0) w = 1.0 + 0.5 * uniform(random);
    samples.push_back({static_cast<float>(ray.x()), static_cast<float>(ray.y()), static_cast<float>(w)});
  }
  return samples;
}

bool fit(const std::vector<PlaneSample>& samples, Lean lean, const Vec3& up, InversePlane& plane, std::int32_t& inliers,
         std::int32_t* trials = nullptr) {
  PlaneRansac ransac;
  ransac.begin(5, samples);
  while (!ransac.step({}, kNoise, lean, up)) {
  }
  if (trials != nullptr) *trials = ransac.trials();
  return ransac.try_finish({}, kNoise, lean, up, plane, inliers);
}

TEST(PlaneFit, Ransac_ThirtyPercentOutliers_FindsThePlane) {
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

TEST(PlaneFit, Ransac_NarrowStrip_TakesItsTiltFromGravity) {
  const Vec3 normal = Vec3{0.0, -0.5, -0.866}.normalized();
  std::vector<PlaneSample> samples = sample_plane(normal, 0.7, 200, 0.0, 3);
  const InversePlane truth{-normal / 0.7};
  std::mt19937 random(9);
  std::normal_distribution<> gauss;
  for (PlaneSample& s : samples) {
    s.y = 0.01F * s.y;
    const Vec3 ray{static_cast<double>(s.x), static_cast<double>(s.y), 1.0};
    s.w = static_cast<float>(truth.inverse_depth(ray) + gauss(random) * inverse_depth_sigma(kNoise, truth, ray));
  }
  InversePlane plane;
  std::int32_t inliers = 0;
  ASSERT_TRUE(fit(samples, Lean::kLevel, normal, plane, inliers));
  EXPECT_LT(math::acos(std::min(1.0, plane.normal().dot(normal))), 0.02);
}

TEST(PlaneFit, Ransac_WrongLeanOrTooFewSamples_FindsNothing) {
  const Vec3 normal = Vec3{0.0, -0.5, -0.866}.normalized();
  InversePlane plane;
  std::int32_t inliers = 0;
  EXPECT_FALSE(fit(sample_plane(normal, 0.7, 256, 0.0, 1), Lean::kUpright, normal, plane, inliers));
  EXPECT_FALSE(fit(sample_plane(normal, 0.7, 2, 0.0, 1), Lean::kAny, normal, plane, inliers));
  const std::vector<PlaneSample> same(100, {0.1F, 0.1F, 1.0F});
  EXPECT_FALSE(fit(same, Lean::kAny, normal, plane, inliers));
}

TEST(PlaneFit, Ransac_CleanData_StopsEarlyAndRepeatsExactly) {
  const Vec3 normal = Vec3{0.0, -0.5, -0.866}.normalized();
  const std::vector<PlaneSample> samples = sample_plane(normal, 0.7, 256, 0.0, 1);
  InversePlane a, b;
  std::int32_t inliers = 0, trials = 0;
  ASSERT_TRUE(fit(samples, Lean::kLevel, normal, a, inliers, &trials));
  EXPECT_LT(trials, PlaneFit::Params{}.trials);
  ASSERT_TRUE(fit(samples, Lean::kLevel, normal, b, inliers));
  EXPECT_EQ(a.m, b.m);
}

TEST(PlaneFit, Solve_WhiteNoise_IsUnbiasedAndItsSigmaIsHonest) {
  const Vec3 normal = Vec3{0.1, -0.5, -0.85}.normalized();
  DepthSigma noise;
  noise.correlated_px = 1.0;  // this noise is white
  const Vec3 ray{0.0, 0.0, 1.0};
  double bias = 0.0, squares = 0.0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    PlaneMoments moments;
    const InversePlane truth{-normal / 0.7};
    for (const PlaneSample& s : sample_plane(normal, 0.7, 300, 0.0, static_cast<std::uint32_t>(run + 1))) {
      const Vec3 r{static_cast<double>(s.x), static_cast<double>(s.y), 1.0};
      moments.add(1.0 / math::square(inverse_depth_sigma(kNoise, truth, r)), r.x(), r.y(), static_cast<double>(s.w));
    }
    InversePlane plane;
    Mat3 covariance;
    ASSERT_TRUE(try_solve({}, noise, moments, Lean::kAny, Vec3::UnitZ(), plane, &covariance));
    const double error = plane.distance_m(truth.point(ray)), sigma = plane_sigma_m(plane, covariance, ray);
    bias += error / kRuns;
    squares += math::square(error / sigma) / kRuns;
  }
  EXPECT_LT(std::abs(bias), 0.00005);
  EXPECT_NEAR(std::sqrt(squares), 1.0, 0.15);
}

TEST(PlaneFit, Moments_OfTwoHalves_AddUpToTheWhole) {
  const std::vector<PlaneSample> samples = sample_plane(Vec3{0, -0.5, -0.866}.normalized(), 0.7, 100, 0.0, 4);
  PlaneMoments whole, first, second;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto x = static_cast<double>(samples[i].x), y = static_cast<double>(samples[i].y);
    whole.add(1.0, x, y, static_cast<double>(samples[i].w));
    (i < 50 ? first : second).add(1.0, x, y, static_cast<double>(samples[i].w));
  }
  first.add(second);
  EXPECT_LT((first.matrix() - whole.matrix()).norm() + (first.vector() - whole.vector()).norm(), 1e-9);
}

TEST(PlaneFit, Solve_NoOrDegenerateMoments_IsRefused) {
  InversePlane plane;
  EXPECT_FALSE(try_solve({}, {}, {}, Lean::kAny, Vec3::UnitZ(), plane, nullptr));
  PlaneMoments point;
  for (int i = 0; i < 10; ++i) point.add(1.0, 0.1, 0.2, 1.0);
  EXPECT_FALSE(try_solve({}, {}, point, Lean::kAny, Vec3::UnitZ(), plane, nullptr));
}

TEST(CounterRandom, Draws_AreSpreadAndFixed) {
  EXPECT_EQ(counter_random(1, 2), counter_random(1, 2));
  std::array<int, 16> bins{};
  for (std::uint32_t i = 0; i < 16000; ++i) ++bins[counter_random(7, i) % 16];
  for (const int n : bins) EXPECT_NEAR(n, 1000, 160);
}

}  // namespace
}  // namespace polygmap
