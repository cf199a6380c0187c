// SPDX-License-Identifier: Apache-2.0
// Map and foothold search together, on what perception would report on the way up.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "algorithms/foothold/foothold_search.hpp"
#include "algorithms/perception/map/polygon_map.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/seen_stairs.hpp"

namespace polygmap {
namespace {

using test::Noise;
using test::Stairs;

struct ClimbErrors {
  double along_m = 0.0, across_m = 0.0, height_m = 0.0, yaw_rad = 0.0;
  int found = 0;
};

struct PoseError {
  double jitter_m = 0.002;
  double drift_mps = 0.001;  // in a direction of the seed's
  double sigma_m = 0.002;    // as the pose states it, at the start ...
  double sigma_growth_mps = 0.0;
};

// Climbs a staircase with a pose that drifts and jitters in common for all surfaces of a frame; before each step the
// search runs on the map. Errors are those of the heel's distance to the true nosing, in the frame that the robot
// believes in at that moment.
ClimbErrors climb(const Stairs& stairs, const Noise& noise, const PoseError& pose, unsigned seed,
                  bool half_lost = false) {
  auto map = std::make_unique<PolygonMap>();
  auto search = std::make_unique<FootholdSearch>(FootholdSearch::Params{}, nominal_robot().sole);
  std::mt19937 random(seed);
  std::normal_distribution<> jitter(0.0, 1.0);
  ClimbErrors errors;
  std::int64_t stamp = kNsPerS;
  Vec3 drift = Vec3::Zero();
  const Vec3 drift_direction = Vec3{jitter(random), jitter(random), jitter(random)}.normalized();
  const auto middle_on = [&](int k) {
    return Vec3{stairs.world_T_stairs() * Vec3{k == 0 ? -0.3 : stairs.nosing_x_m(k) + 0.0872, 0.0, k * stairs.rise_m}};
  };
  for (int k = 0; k < stairs.steps; ++k) {
    const Vec3 from = middle_on(std::max(0, k - 1)), to = middle_on(k);
    for (int i = 0; i <= 78; ++i) {  // 2.6 s: half of it moving, then standing
      stamp += 33'333'333;
      drift += drift_direction * pose.drift_mps / 30.0;
      const Vec3 middle = from + std::min(1.0, i / 39.0) * (to - from);
      const Transform base = test::base_above(middle, stairs.yaw_rad);
      const Transform camera = test::camera_of(base);
      SurfaceFrame frame = test::seen_from(stairs, camera, stamp, noise, random);
      if (half_lost && i % 2 == 0) frame.surfaces.clear();  // half of the frames lost altogether
      Transform believed = camera;
      believed.p_m += drift + pose.jitter_m * Vec3{jitter(random), jitter(random), jitter(random)};
      const double sigma_m = pose.sigma_m + pose.sigma_growth_mps * seconds(stamp - kNsPerS);
      map->begin(frame, {believed, sigma_m, 0.002, robot_camera_intrinsics()});
      WorkBudget budget(1 << 20);
      EXPECT_EQ(map->step(budget), Progress::kDone);
    }
    FootholdSearch::Query query;
    query.odom_T_base = test::base_above(to + drift, stairs.yaw_rad);
    query.odom_T_sole = test::soles_at(to + drift, stairs.yaw_rad);
    query.climbing = k > 0;
    search->begin(map->snapshot(), query);
    WorkBudget budget(1 << 20);
    EXPECT_EQ(search->step(budget), Progress::kDone);
    const FootholdSet& found = search->result();
    EXPECT_EQ(found.obstruction, StopReason::kNone) << "before step " << k + 1;
    if (found.obstruction != StopReason::kNone) continue;
    ++errors.found;
    for (const Foothold& f : found.p_star_feet) {
      const Vec3 p = stairs.world_T_stairs().inverse() * (f.position_m - drift);
      const double ideal = k + 1 < stairs.steps ? 0.5 * (stairs.tread_m - 0.179 + 0.073164) : -1.0;
      if (ideal > 0.0) {
        errors.along_m = std::max(errors.along_m, std::abs(p.x() - stairs.nosing_x_m(k + 1) - ideal));
      }
      errors.height_m = std::max(errors.height_m, std::abs(p.z() - (k + 1) * stairs.rise_m));
      errors.yaw_rad = std::max(errors.yaw_rad, std::abs(math::wrap_angle(f.yaw_rad - stairs.yaw_rad)));
      EXPECT_NEAR(f.nosing_distance_m, p.x() - stairs.nosing_x_m(k + 1), 0.006);
    }
  }
  return errors;
}

TEST(MapToFootholds, NoisyClimb_EveryFootholdIsWithin4mm) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Stairs stairs{.steps = 10,
                        .rise_m = 0.10 + 0.007 * seed,
                        .tread_m = 0.275 + 0.001 * seed,
                        .width_m = seed % 2 ? 1.2 : 0.7,
                        .yaw_rad = 0.03 * seed - 0.15};
    const ClimbErrors e = climb(stairs, {0.003, 0.002, 0.003}, {}, seed);
    EXPECT_EQ(e.found, 10);
    EXPECT_LT(e.along_m, 0.004) << seed;
    EXPECT_LT(e.height_m, 0.004) << seed;
    EXPECT_LT(e.yaw_rad, 0.01) << seed;
  }
}

// The map stays where it was, the footholds go with the pose that executes them.
TEST(MapToFootholds, DriftOf80mmThatTheCovarianceAdmits_NoFootholdIsOff) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const ClimbErrors e = climb({.steps = 6}, {0.003, 0.002, 0.003}, {0.002, 0.005, 0.002, 0.003}, seed);
    EXPECT_EQ(e.found, 6);
    EXPECT_LT(e.along_m, 0.005) << seed;
    EXPECT_LT(e.height_m, 0.005) << seed;
  }
}

TEST(MapToFootholds, HalfOfTheFramesLost_ClimbStillWorks) {
  const ClimbErrors e = climb({.steps = 6}, {0.003, 0.002, 0.003}, {}, 3, true);
  EXPECT_EQ(e.found, 6);
  EXPECT_LT(e.along_m, 0.005);
}

TEST(MapToFootholds, Nosing20mm_FeetKeepClearOfTheOverhang) {
  const ClimbErrors e = climb({.steps = 6, .nosing_m = 0.02}, {0.003, 0.002, 0.003}, {}, 4);
  EXPECT_EQ(e.found, 6);
  EXPECT_LT(e.along_m, 0.004);
}

TEST(MapToFootholds, WideDeepLanding_EndsInTop) {
  auto map = std::make_unique<PolygonMap>();
  auto search = std::make_unique<FootholdSearch>(FootholdSearch::Params{}, nominal_robot().sole);
  std::mt19937 random(1);
  const Stairs stairs{.steps = 2};
  const Vec3 top{stairs.nosing_x_m(2) + 0.0872, 0, 0.26};
  const Transform base = test::base_above(top, 0.0);
  for (int i = 0; i < 60; ++i) {
    map->begin(test::seen_from(stairs, test::camera_of(base), kNsPerS + i * 33'333'333, {0.003, 0.002, 0.002}, random),
               {test::camera_of(base), 0.002, 0.002, robot_camera_intrinsics()});
    WorkBudget budget(1 << 20);
    ASSERT_EQ(map->step(budget), Progress::kDone);
  }
  FootholdSearch::Query query{base, test::soles_at(top, 0.0), Foot::kLeft, true};
  search->begin(map->snapshot(), query);
  WorkBudget budget(1 << 20);
  ASSERT_EQ(search->step(budget), Progress::kDone);
  EXPECT_EQ(search->result().obstruction, StopReason::kTop);
}

}  // namespace
}  // namespace polygmap
