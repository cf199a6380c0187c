// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/foot_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace polygmap {
namespace {

constexpr double kTick_s = 0.002;

// Steps of 2 ms of two feet, each moving over the ground at its speed along x.
class FootMotionTest : public testing::Test {
 protected:
  FootMotionTest() { motion_.reset({}); }
  void step(double left_mps, double right_mps, bool left_rests = true, bool right_rests = true,
            const Vec3& odom_w_radps = Vec3::Zero()) {
    std::array<FootMotion::Step, kFootCount> steps;
    steps[0].rests = left_rests;
    steps[1].rests = right_rests;
    const std::array<double, kFootCount> speed_mps{left_mps, right_mps};
    for (std::size_t foot = 0; foot < kFootCount; ++foot) {
      const Vec3 noise_m = 3e-5 * Vec3{normal_(random_), normal_(random_), normal_(random_)};
      steps[foot].sole_known = true;
      steps[foot].odom_from_base_m = {0.0, foot == 0 ? 0.1 : -0.1, -0.8};
      steps[foot].odom_rad = kTick_s * odom_w_radps;
      steps[foot].odom_m =
          kTick_s * (Vec3{speed_mps[foot], 0, 0} + odom_w_radps.cross(steps[foot].odom_from_base_m)) + noise_m;
    }
    motion_.update(steps, kTick_s);
  }
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
  FootMotion motion_;
};

TEST_F(FootMotionTest, TwoFeetThatRest_AreNeverLetGo) {
  for (int i = 0; i < 2000; ++i) {
    step(0.0, 0.0);
    ASSERT_EQ(motion_.walk_m2ps(0), 0.0);
    ASSERT_EQ(motion_.walk_m2ps(1), 0.0);
  }
}

// What an IMU that errs makes of the base moves both feet alike.
TEST_F(FootMotionTest, BaseIsThoughtToMove_FeetAreEachOthersWitnesses) {
  for (int i = 0; i < 500; ++i) {
    step(0.5, 0.5);
    ASSERT_EQ(motion_.walk_m2ps(0), 0.0);
    ASSERT_EQ(motion_.walk_m2ps(1), 0.0);
  }
}

TEST_F(FootMotionTest, OneOfTwoSlips_IsLetGoAndTheOtherHolds) {
  for (int i = 0; i < 100; ++i) step(0.0, 0.0);
  for (int i = 0; i < 30; ++i) step(0.0, 0.3);
  EXPECT_EQ(motion_.walk_m2ps(0), 0.0);
  EXPECT_GT(motion_.walk_m2ps(1), 0.01);
  for (int i = 0; i < 30; ++i) step(0.0, 0.0);
  EXPECT_EQ(motion_.walk_m2ps(1), 0.0);
}

TEST_F(FootMotionTest, FootThatStandsAloneSlips_IsLetGoForALimitedTime) {
  for (int i = 0; i < 500; ++i) step(0.0, 0.0, true, false);
  int let_go = 0;
  for (int i = 0; i < 1000; ++i) {
    step(0.4, 0.0, true, false);
    if (motion_.walk_m2ps(0) > 0.0) ++let_go;
  }
  EXPECT_GT(let_go, 150);
  EXPECT_LE(let_go * kTick_s, FootMotion::Params{}.most_s + kTick_s);
}

// 6 mm within 30 ms, and back within 60: what hip and knee with half a degree of play do when the other leg swings.
TEST_F(FootMotionTest, FootThatStandsAloneMovesByItsJointsPlay_IsNotLetGo) {
  for (int i = 0; i < 500; ++i) step(0.0, 0.0, true, false);
  for (const double way_m : {0.006, -0.006}) {
    const int steps = way_m > 0.0 ? 15 : 30;
    for (int i = 0; i < steps; ++i) {
      step(way_m / (steps * kTick_s) * (1.0 - std::cos(2.0 * kPi * (i + 0.5) / steps)), 0.0, true, false);
      ASSERT_EQ(motion_.walk_m2ps(0), 0.0);
    }
    for (int i = 0; i < 100; ++i) {
      step(0.0, 0.0, true, false);
      ASSERT_EQ(motion_.walk_m2ps(0), 0.0);
    }
  }
}

TEST_F(FootMotionTest, FootThatStandsAloneSlips_IsLetGoBeforeTwelveMillimetres) {
  for (int i = 0; i < 500; ++i) step(0.0, 0.0, true, false);
  double moved_m = 0.0;
  while (motion_.walk_m2ps(0) <= 0.0) {
    step(0.3, 0.0, true, false);
    moved_m += 0.3 * kTick_s;
    ASSERT_LT(moved_m, 0.012);
  }
}

TEST_F(FootMotionTest, BaseIsThoughtToTurn_SoleTellsThatTheFootRests) {
  for (int i = 0; i < 500; ++i) {
    step(0.0, 0.0, true, false, {0.0, 0.5, 0.0});  // 0.4 m/s at the foot
    ASSERT_EQ(motion_.walk_m2ps(0), 0.0);
  }
}

TEST_F(FootMotionTest, FootThatHasJustLanded_ItsSwingDoesNotCount) {
  for (int i = 0; i < 50; ++i) step(0.0, 1.0, true, false);
  step(0.0, 0.0);
  EXPECT_EQ(motion_.walk_m2ps(0), 0.0);
  EXPECT_EQ(motion_.walk_m2ps(1), 0.0);
}

}  // namespace
}  // namespace polygmap
