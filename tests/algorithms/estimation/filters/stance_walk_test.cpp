// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/filters/stance_walk.hpp"

#include <gtest/gtest.h>

#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_s;
using Stands = std::array<bool, kFootCount>;

// Numbers of the tests' own, whatever those of the module are tuned to.
StanceWalk::Params round_numbers() {
  StanceWalk::Params params;
  params.contact_mprs = 6e-3;
  params.contact_rs = 4e-3;
  params.full_mps = 0.1;
  params.bedding_s = 100.0;
  params.least_mprs = 3e-4;
  params.point_mprs = 0.015;
  params.point_rs = 0.02;
  params.landing_mprs = 5e-3;
  params.landing_s = 0.05;
  params.unloading_mprs = 7e-3;
  params.unloading_s = 0.3;
  params.vertical_share = 0.5;
  params.sole_radprs = 1e-4;
  params.sole_radpmrs = 5e-3;
  params.sole_yaw_radprs = 3e-4;
  params.sole_yaw_radpmrs = 0.015;
  return params;
}

class StanceWalkTest : public testing::Test {
 protected:
  StanceWalkTest() { walk_.reset(round_numbers()); }
  void stand(const Stands& stands, double for_s) {
    const int ticks = static_cast<int>(for_s / kTick_s + 0.5);
    for (int i = 0; i < ticks; ++i) walk_.update(stands, kTick_s);
  }
  [[nodiscard]] double x_m2ps(std::size_t foot, double speed_mps = 0.0, bool sole_known = true) const {
    return walk_.contact_m2ps(foot, sole_known, speed_mps * speed_mps).x();
  }
  StanceWalk walk_;
};

class StanceWalkOfOldStance : public StanceWalkTest {
 protected:
  StanceWalkOfOldStance() { stand({true, true}, 10.0); }
};

TEST_F(StanceWalkOfOldStance, AtRest_CreepsLeast) {
  for (const std::size_t foot : {0U, 1U}) {
    EXPECT_NEAR(x_m2ps(foot), 9e-8, 1e-16);
    EXPECT_NEAR(x_m2ps(foot, 0.0, false), 9e-8, 1e-16);
  }
  EXPECT_GT(x_m2ps(0, 0.006), 9e-8 + 2e-8);  // 6 % of the pace is more than the least
}

TEST_F(StanceWalkOfOldStance, MovingBase_CreepsByThePaceAndNoFasterThanInFull) {
  EXPECT_NEAR(x_m2ps(0, 0.05), 9e-6 + 4e-8, 1e-13);
  EXPECT_NEAR(x_m2ps(0, 0.1), 36e-6 + 16e-8, 1e-13);
  EXPECT_NEAR(x_m2ps(0, 0.2), 36e-6 + 64e-8, 1e-13);
  EXPECT_EQ(x_m2ps(0, 0.2), x_m2ps(1, 0.2));
}

TEST(StanceWalk, StanceThatOutlastsTheBedding_CreepsLessInInverseProportionDownToItsShare) {
  StanceWalk::Params params = round_numbers();
  params.bedding_s = 2.0;
  params.bedded_share = 0.25;
  StanceWalk walk;
  walk.reset(params);
  const auto x_m2ps_after = [&](double more_s) {
    for (int i = 0; i < static_cast<int>(more_s / kTick_s + 0.5); ++i) walk.update({true, true}, kTick_s);
    return walk.contact_m2ps(0, true, 0.01).x();
  };
  constexpr double kWhole_m2ps = 36e-6 + 16e-8;
  EXPECT_NEAR(x_m2ps_after(1.0), kWhole_m2ps, 1e-12);
  EXPECT_NEAR(x_m2ps_after(4.0 - walk.age_s(0)), kWhole_m2ps / 4.0, 1e-12);
  EXPECT_NEAR(x_m2ps_after(100.0), kWhole_m2ps / 16.0, 1e-12);
  walk.update({false, true}, kTick_s);
  EXPECT_NEAR(x_m2ps_after(1.0), kWhole_m2ps, 1e-12);  // of a new stance
}

TEST_F(StanceWalkOfOldStance, PointFoot_CreepsMoreThanASole) {
  EXPECT_NEAR(x_m2ps(0, 0.1, false), 225e-6 + 4e-6, 1e-12);
  EXPECT_NEAR(x_m2ps(0, 0.2, false), 225e-6 + 16e-6, 1e-12);
  EXPECT_GT(x_m2ps(0, 0.02, false), 4.0 * x_m2ps(0, 0.02, true));
}

TEST_F(StanceWalkOfOldStance, UpAndDown_WalksByItsShare) {
  const Vec3 walk_m2ps = walk_.contact_m2ps(0, true, 0.01);
  EXPECT_EQ(walk_m2ps.y(), walk_m2ps.x());
  EXPECT_NEAR(walk_m2ps.z(), 0.25 * (36e-6 + 16e-8), 1e-13);
}

TEST_F(StanceWalkOfOldStance, Sole_RocksAndTurnsWithTheSpeedEachByItsOwn) {
  const Vec3 rest_rad2ps = walk_.sole_rad2ps(0.0), moving_rad2ps = walk_.sole_rad2ps(0.01);
  EXPECT_NEAR(rest_rad2ps.x(), 1e-8, 1e-16);
  EXPECT_NEAR(rest_rad2ps.z(), 9e-8, 1e-16);
  EXPECT_NEAR(moving_rad2ps.x(), 26e-8, 1e-15);
  EXPECT_NEAR(moving_rad2ps.y(), 26e-8, 1e-15);
  EXPECT_NEAR(moving_rad2ps.z(), 9.0 * 26e-8, 1e-15);
}

TEST_F(StanceWalkOfOldStance, FootHasLanded_SettlesAndThatFades) {
  stand({true, false}, 0.5);
  EXPECT_FALSE(walk_.stands(1));
  EXPECT_EQ(walk_.age_s(1), 0.0);
  stand({true, true}, 0.05);
  EXPECT_NEAR(x_m2ps(1), 9e-8 + 25e-6 * std::exp(-1.0), 1e-13);
  stand({true, true}, 0.05);
  EXPECT_NEAR(x_m2ps(1), 9e-8 + 25e-6 * std::exp(-2.0), 1e-13);
  stand({true, true}, 1.0);
  EXPECT_NEAR(x_m2ps(1), 9e-8, 1e-13);
}

TEST_F(StanceWalkOfOldStance, OtherFootHasLanded_TheOldOneGivesWayWhileItIsUnloaded) {
  stand({true, false}, 0.5);
  EXPECT_NEAR(x_m2ps(0), 9e-8, 1e-13);  // the other one is in the air
  stand({true, true}, 0.298);
  EXPECT_NEAR(x_m2ps(0), 9e-8 + 49e-6, 1e-13);
  EXPECT_LT(x_m2ps(1), 9e-8 + 25e-6 * std::exp(-5.0));  // the one that landed bears more and more
  stand({true, true}, 0.004);
  EXPECT_NEAR(x_m2ps(0), 9e-8, 1e-13);
  stand({false, true}, 0.5);
  stand({true, true}, 0.1);
  EXPECT_NEAR(x_m2ps(1), 9e-8 + 49e-6, 1e-12);  // and the other way round
}

TEST_F(StanceWalkOfOldStance, BothHaveLandedAtOnce_NeitherUnloadsTheOther) {
  stand({false, false}, 0.2);
  stand({true, true}, 0.1);
  for (const std::size_t foot : {0U, 1U}) EXPECT_NEAR(x_m2ps(foot), 9e-8 + 25e-6 * std::exp(-2.0), 1e-13);
}

TEST_F(StanceWalkTest, FirstStep_FeetHaveStoodForLongAndNeitherIsUnloaded) {
  stand({true, true}, kTick_s);
  for (const std::size_t foot : {0U, 1U}) EXPECT_LT(x_m2ps(foot), 3.0 * 9e-8);
}

}  // namespace
}  // namespace polygmap
