// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/plane_fit.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "algorithms/perception/polygons/counter_random.hpp"
#include "tests/support/plane_samples.hpp"

namespace polygmap {
namespace {

using test::kSampleNoise;
using test::sample_plane;

TEST(PlaneFit, Solve_WhiteNoise_IsUnbiasedAndItsSigmaIsHonest) {
  const Vec3 normal = Vec3{0.1, -0.5, -0.85}.normalized();
  DepthNoiseModel noise;
  noise.correlated_px = 1.0;  // this noise is white
  const Vec3 ray{0.0, 0.0, 1.0};
  double bias = 0.0, squares = 0.0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    PlaneMoments moments;
    const InversePlane truth{-normal / 0.7};
    for (const PlaneSample& s : sample_plane(normal, 0.7, 300, 0.0, static_cast<std::uint32_t>(run + 1))) {
      const Vec3 r{static_cast<double>(s.x), static_cast<double>(s.y), 1.0};
      moments.add(1.0 / math::square(inverse_depth_sigma(kSampleNoise, truth, r)), r.x(), r.y(),
                  static_cast<double>(s.w));
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

TEST(PlaneFit, SolveLeaning_FewPixelsOfALevelPlane_ComesOutLevel_AManyPixelSlopeStays) {
  DepthNoiseModel noise;
  const auto moments_of = [](const Vec3& normal, std::size_t samples) {
    PlaneMoments moments;
    const InversePlane truth{-normal / 0.7};
    for (const PlaneSample& s : sample_plane(normal, 0.7, samples, 0.0, 7)) {
      const Vec3 r{static_cast<double>(s.x), static_cast<double>(s.y), 1.0};
      moments.add(1.0 / math::square(inverse_depth_sigma(kSampleNoise, truth, r)), r.x(), r.y(),
                  static_cast<double>(s.w));
    }
    return moments;
  };
  const Vec3 normal = Vec3{0.0, -0.5, -0.85}.normalized(), up = Vec3{0.1, -0.5, -0.85}.normalized();
  InversePlane free, leaning;
  // 100 pixels say less than one independent measurement: 6 degrees off level are no contradiction.
  ASSERT_TRUE(try_solve({}, noise, moments_of(normal, 100), Lean::kAny, up, free, nullptr));
  ASSERT_TRUE(try_solve_leaning({}, noise, moments_of(normal, 100), up, leaning, nullptr));
  EXPECT_GT(leaning.normal().dot(up), free.normal().dot(up));
  EXPECT_GT(leaning.normal().dot(up), std::cos(0.01));
  // 200 independent ones do contradict it.
  noise.correlated_px = 1.0;
  ASSERT_TRUE(try_solve({}, noise, moments_of(normal, 200), Lean::kAny, up, free, nullptr));
  ASSERT_TRUE(try_solve_leaning({}, noise, moments_of(normal, 200), up, leaning, nullptr));
  EXPECT_LT((leaning.m - free.m).norm(), 1e-12);
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

TEST(PlaneFit, Moments_OfAFrameOfTheirOwn_MovedAreThoseOfTheSamples) {
  const double y0 = -0.3, pitch = 0.002;
  const Vec3 plane{0.1, 0.004, 1.2};
  PlaneMoments own, samples;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const double x = 0.01 * i, t = counter_random(1, i) % 50, g = 1.0 + i % 4, r = 0.001 * (i % 5);
    own.add(g, x, t, r);
    samples.add(g, x, y0 + pitch * t, r + plane.dot(Vec3{x, t, 1.0}));
  }
  const PlaneMoments moved = own.moved(y0, pitch, plane);
  EXPECT_LT((moved.matrix() - samples.matrix()).norm(), 1e-9 * samples.matrix().norm());
  EXPECT_LT((moved.vector() - samples.vector()).norm(), 1e-9 * samples.vector().norm());
  EXPECT_EQ(moved.count, samples.count);
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
