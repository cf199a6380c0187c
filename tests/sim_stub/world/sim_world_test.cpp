// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim_stub/camera/counter_noise.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/stair_world.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

TEST(CounterNoise, Normal_AMillionDraws_HasTheMomentsAndTailsOfANormal) {
  const CounterNoise noise(7, Stream::kGyro);
  constexpr int kCount = 1'000'000;
  double sum = 0, squares = 0, cubes = 0, fourths = 0, lagged = 0, previous = 0;
  int beyond_two = 0, beyond_four = 0;
  for (int i = 0; i < kCount; ++i) {
    const double x = noise.normal(static_cast<std::uint64_t>(i));
    sum += x;
    squares += x * x;
    cubes += x * x * x;
    fourths += x * x * x * x;
    lagged += x * previous;
    previous = x;
    beyond_two += std::abs(x) > 2.0 ? 1 : 0;
    beyond_four += std::abs(x) > 4.0 ? 1 : 0;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.004);
  EXPECT_NEAR(squares / kCount, 1.0, 0.006);
  EXPECT_NEAR(cubes / kCount, 0.0, 0.015);
  EXPECT_NEAR(fourths / kCount, 3.0, 0.05);
  EXPECT_NEAR(lagged / kCount, 0.0, 0.004);
  EXPECT_NEAR(beyond_two, 45500, 900);
  EXPECT_NEAR(beyond_four, 63, 32);
}

TEST(CounterNoise, Uniform_Draws_FillTheirIntervalEvenly) {
  const CounterNoise noise(7, Stream::kStart);
  std::array<int, 16> bins{};
  for (std::uint64_t i = 0; i < 160000; ++i) {
    const double x = noise.uniform(i, -2.0, 6.0);
    ASSERT_GE(x, -2.0);
    ASSERT_LT(x, 6.0);
    ++bins[static_cast<std::size_t>((x + 2.0) * 2.0)];
  }
  for (const int bin : bins) EXPECT_NEAR(bin, 10000, 500);
}

TEST(CounterNoise, SeedsAndStreams_SameIndex_AreIndependent) {
  const CounterNoise a(1, Stream::kGyro), b(2, Stream::kGyro), c(1, Stream::kAccel);
  double ab = 0, ac = 0;
  for (std::uint64_t i = 0; i < 100000; ++i) {
    ab += a.normal(i) * b.normal(i);
    ac += a.normal(i) * c.normal(i);
  }
  EXPECT_NEAR(ab / 100000, 0.0, 0.013);
  EXPECT_NEAR(ac / 100000, 0.0, 0.013);
}

TEST(MakeStairs, Jitter_StaysInItsRangeAndComesFromTheSeed) {
  const StairParams params{.steps = 40, .rise_m = 0.15, .tread_m = 0.28, .nosing_m = 0.02};
  const StairWorld world = make_stairs(params, 5), again = make_stairs(params, 5), other = make_stairs(params, 6);
  ASSERT_EQ(world.steps.size(), 40U);
  EXPECT_EQ(world.steps.front().riser_x_m, 0.0);
  double below_m = 0, most = 0;
  for (std::size_t k = 0; k < 40; ++k) {
    const Step& s = world.steps[k];
    EXPECT_NEAR(s.height_m - below_m, 0.15, 0.005);
    most = std::max(most, std::abs(s.height_m - below_m - 0.15));
    if (k < 39) {
      EXPECT_NEAR(s.back_x_m - s.riser_x_m, 0.28, 0.005);
      EXPECT_EQ(s.back_x_m, world.steps[k + 1].riser_x_m);
    }
    EXPECT_NEAR(s.riser_x_m - s.nosing_x_m, 0.02, 1e-12);
    EXPECT_EQ(s.height_m, again.steps[k].height_m);
    below_m = s.height_m;
  }
  EXPECT_GT(most, 0.004);
  EXPECT_NE(world.steps[3].height_m, other.steps[3].height_m);
  EXPECT_NEAR(world.steps.back().back_x_m - world.steps.back().riser_x_m, 1.0, 1e-12);
}

TEST(StairWorld, HeightAt_PlacesAroundTheStaircase_IsTheTopSurface) {
  const StairWorld world = make_stairs({.steps = 3, .nosing_m = 0.02, .jitter_m = 0.0}, 1);
  int step = 99;
  EXPECT_EQ(world.height_m(-0.1, 0.0, &step), 0.0);
  EXPECT_EQ(step, kFloorStep);
  EXPECT_NEAR(world.height_m(-0.01, 0.0, &step), 0.13, 1e-12);  // on the nosing
  EXPECT_EQ(step, 0);
  EXPECT_NEAR(world.height_m(0.27, 0.59, &step), 0.26, 1e-12);
  EXPECT_EQ(step, 1);
  EXPECT_NEAR(world.height_m(1.5, 0.0, &step), 0.39, 1e-12);
  EXPECT_EQ(step, 2);
  EXPECT_EQ(world.height_m(1.6, 0.0, &step), 0.0);  // behind the landing
  EXPECT_EQ(world.height_m(0.5, 0.61, &step), 0.0);
  EXPECT_EQ(step, kFloorStep);
}

// A grid of points over a box's surface and inside, at most spacing apart.
std::vector<Vec3> sampled(const OrientedBox& box, double spacing_m) {
  std::vector<Vec3> points;
  const Eigen::Vector3i n = (2.0 * box.half_m / spacing_m).array().ceil().cast<int>();
  for (int i = 0; i <= n.x(); ++i) {
    for (int j = 0; j <= n.y(); ++j) {
      for (int k = 0; k <= n.z(); ++k) {
        const Vec3 unit{2.0 * i / n.x() - 1.0, 2.0 * j / n.y() - 1.0, 2.0 * k / n.z() - 1.0};
        points.push_back(box.centre * Vec3(unit.cwiseProduct(box.half_m)));
      }
    }
  }
  return points;
}

double point_distance_m(const Vec3& p, const SolidBox& solid) {
  const Vec3 along = solid.true_T_solid.inverse() * p;
  const Vec3 outside = (solid.min_m - along).cwiseMax(along - solid.max_m);
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0) - solid.round_m;
}

void compare_with_sampled_points(const StairErrors& errors) {
  const StairWorld world = make_stairs({.steps = 4, .nosing_m = 0.02}, 3, errors);
  const std::vector<SolidBox> solids = solids_of(world);
  const CounterNoise noise(11, Stream::kStart);
  constexpr double kSpacing_m = 0.01;
  int apart = 0, inside = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const double x = noise.uniform(8 * i, -0.4, 1.2), y = noise.uniform(8 * i + 1, -0.75, 0.75);
    const double z = world.height_m(x, 0.0) + noise.uniform(8 * i + 2, -0.02, 0.25);
    const Mat3 R = rotation_z(noise.uniform(8 * i + 3, -1, 1)) * rotation_y(noise.uniform(8 * i + 4, -0.5, 0.5)) *
                   rotation_x(noise.uniform(8 * i + 5, -0.5, 0.5));
    const OrientedBox box = collision_box(kSole, {R, Vec3{x, y, z}});
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3& p : sampled(box, kSpacing_m)) {
      least = std::min(least, p.z());
      for (const SolidBox& solid : solids) least = std::min(least, point_distance_m(p, solid));
    }
    const double clearance = clearance_m(box, solids);
    if (least > 0.0 && clearance > 0.0) {
      ++apart;
      EXPECT_LE(clearance, least + 1e-9) << i;
      EXPECT_GT(clearance, least - 0.6 * kSpacing_m) << i;
    } else {
      ++inside;
      EXPECT_LT(clearance, 1e-9) << i;
      // Never more than moving the foot out along one of the world's axes.
      const Vec3 reach = box.centre.R.cwiseAbs() * box.half_m;
      double deepest = std::max(0.0, reach.z() - box.centre.p_m.z());
      for (const SolidBox& s : solids) {
        const Vec3 other = s.box().centre.p_m;
        const Vec3 other_reach = s.box().centre.R.cwiseAbs() * s.half_m() + Vec3::Constant(s.round_m);
        const Vec3 out = reach + other_reach - (box.centre.p_m - other).cwiseAbs();
        deepest = std::max(deepest, out.minCoeff());
      }
      EXPECT_GT(clearance, -deepest - 1e-9) << i;
    }
  }
  EXPECT_GT(apart, 100);
  EXPECT_GT(inside, 50);
}

TEST(Clearance, RandomFeetNearStairs_AgreesWithSampledPoints) { compare_with_sampled_points({}); }

TEST(Clearance, RandomFeetNearTurnedAndWornStairs_AgreesWithSampledPoints) {
  compare_with_sampled_points(
      {.tread_slope_rad = 0.05, .tread_cant_rad = 0.05, .tread_yaw_rad = 0.1, .worn_nosing_m = 0.015});
}

TEST(Clearance, KnownPlaces_HaveTheirGapAndDepth) {
  const StairWorld world = make_stairs({.steps = 3, .jitter_m = 0.0}, 1);
  const std::vector<SolidBox> solids = solids_of(world);
  const auto foot = [](double x, double z, double yaw = 0.0) {
    return collision_box(kSole, {rotation_z(yaw), Vec3{x, 0, z}});
  };
  const double toe = kCollisionRectangle.toe_x_m, half = kCollisionRectangle.half_width_m;
  EXPECT_NEAR(clearance_m(foot(-toe - 0.02, 0.0), solids), 0.0, 1e-12);       // stands on the floor
  EXPECT_NEAR(clearance_m(foot(-toe - 0.02, 0.05), solids), 0.02, 1e-12);     // 20 mm in front of the riser
  EXPECT_NEAR(clearance_m(foot(-toe + 0.008, 0.0), solids), -0.008, 1e-12);   // toe in the riser
  EXPECT_NEAR(clearance_m(foot(0.13, 0.13 - 0.006), solids), -0.029, 1e-12);  // toe in the next riser is worse
  EXPECT_NEAR(clearance_m(foot(0.10, 0.13 - 0.006), solids), -0.006, 1e-12);  // sole in the tread
  const double yaw = 0.2;                                                     // a corner leads
  const double corner = toe * std::cos(yaw) + half * std::sin(yaw);
  EXPECT_NEAR(clearance_m(foot(-corner + 0.01, 0.02, yaw), solids), -0.01, 1e-9);
  // Edge against edge: 30 mm before and 40 mm above the first nosing, and above everything else by more.
  EXPECT_NEAR(clearance_m(foot(-toe - 0.03, 0.17), solids), 0.05, 1e-12);
}

TEST(Clearance, ExcludedSteps_AreLeftOut) {
  const StairWorld world = make_stairs({.steps = 3, .jitter_m = 0.0}, 1);
  const std::vector<SolidBox> solids = solids_of(world);
  const OrientedBox foot =
      collision_box(kSole, {Mat3::Identity(), Vec3{-0.1, 0, 0.0}});  // its toe is in the first riser
  EXPECT_LT(clearance_m(foot, solids), -0.05);
  const std::array<int, 1> step{0};
  EXPECT_NEAR(clearance_m(foot, solids, step), 0.0, 1e-12);  // the floor remains
  const std::array<int, 2> floor_and_step{kFloorStep, 0};
  EXPECT_NEAR(clearance_m(foot, solids, floor_and_step), 0.28 - 0.079, 1e-12);  // the second riser
  const std::array<int, 4> all{kFloorStep, 0, 1, 2};
  EXPECT_TRUE(std::isinf(clearance_m(foot, solids, all)));
}

TEST(SoleMargin, SolesOnATread_IsTheNearestEdge) {
  const StairWorld world = make_stairs({.steps = 3, .jitter_m = 0.0}, 1);
  const auto margin = [&](double x, double y, double yaw, int step) {
    return sole_margin_m({rotation_z(yaw), Vec3{x, y, 0.13}}, world, step);
  };
  const double heel = -kContactRectangle.heel_x_m, toe = kContactRectangle.toe_x_m;
  EXPECT_NEAR(margin(heel + 0.01, 0.1, 0.0, 0), 0.01, 1e-12);
  EXPECT_NEAR(margin(heel - 0.02, 0.1, 0.0, 0), -0.02, 1e-12);         // heel over the nosing
  EXPECT_NEAR(margin(0.28 - toe - 0.005, 0.1, 0.0, 0), 0.005, 1e-12);  // toe at the riser
  EXPECT_NEAR(margin(0.1, 0.6 - 0.05, 0.0, 0), 0.05 - kContactRectangle.half_width_m, 1e-12);
  EXPECT_NEAR(margin(-0.5, 0.0, 0.0, kFloorStep), 0.5 - toe, 1e-12);
  const double yaw = 0.1;
  // The left toe corner leads.
  EXPECT_NEAR(margin(0.1, 0.1, yaw, 0),
              0.28 - (0.1 + toe * std::cos(yaw) + kContactRectangle.half_width_m * std::sin(yaw)), 1e-12);
}

}  // namespace
}  // namespace polygmap::sim
