// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/torso.hpp"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/core/time.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

TEST(TorsoTrajectory, EveryDuration_HeightHasNoLeapBetweenTwoTicks) {
  for (std::int32_t ticks = 1; ticks <= 1000; ++ticks) {
    const auto from = TorsoTrajectory::at_rest({Mat3::Identity(), Vec3{0, 0, 0.70}});
    TorsoTrajectory torso;
    torso.plan(from, {{0, 0, 0.83}}, ticks, ticks);
    const double most_mps2 = 5.78 * 0.13 / math::square(ticks * kTick_s);  // of a quintic between two rests
    for (std::int32_t tick = 0; tick <= ticks; ++tick) {
      const Motion z = torso.at(tick, {})[2];
      ASSERT_LE(std::abs(z.acceleration), most_mps2) << tick << " of " << ticks;
      ASSERT_GE(z.position, 0.70 - 1e-12);
      ASSERT_LE(z.position, 0.83 + 1e-12);
    }
    EXPECT_NEAR(torso.at(ticks, {})[2].position, 0.83, 1e-12);
  }
}

TEST(ReachHeight, AtThatHeight_LegHasThatLength) {
  const LegGeometry g;
  std::mt19937 random(5);
  std::uniform_real_distribution<> place(-0.15, 0.15);
  for (int i = 0; i < 200; ++i) {
    const Foot leg = i % 2 == 0 ? Foot::kLeft : Foot::kRight;
    const SolePose sole{{place(random), side_sign(leg) * 0.1 + 0.5 * place(random), place(random)}, 0};
    const double z = reach_height_m(g, {}, leg, sole, 0.6);
    const LegSolution s = solve_leg(g, leg, Transform{Mat3::Identity(), Vec3{0, 0, z}}.inverse() * sole.transform());
    const double length = math::sqrt(g.thigh_m * g.thigh_m + g.shank_m * g.shank_m +
                                     2 * g.thigh_m * g.shank_m * math::cos(s.q_rad[kKnee]));
    EXPECT_NEAR(length, 0.6, 0.001);
  }
}

}  // namespace
}  // namespace polygmap
