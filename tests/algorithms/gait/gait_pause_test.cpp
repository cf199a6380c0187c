// SPDX-License-Identifier: Apache-2.0
// A gait that is paused and goes on, and one that is restarted after its end.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "tests/support/ideal_climb.hpp"

namespace polygmap {
namespace {

using test::IdealClimb;

struct When {
  GaitPhase phase;
  std::uint32_t swing;
  std::uint32_t last_swing;  // that is finished all the same
};
constexpr std::array kMoments{When{GaitPhase::kStandstill, 0, 0}, When{GaitPhase::kDoubleSupport, 0, 0},
                              When{GaitPhase::kSwing, 1, 1},      When{GaitPhase::kDoubleSupport, 2, 2},
                              When{GaitPhase::kSwing, 5, 5},      When{GaitPhase::kSwing, 6, 6}};

class GaitPause : public testing::TestWithParam<GaitPattern> {
 protected:
  [[nodiscard]] static Gait::Params params() {
    Gait::Params params;
    params.planner.pattern = GetParam();
    return params;
  }
  static void tick(IdealClimb& climb, int ticks) {
    for (int i = 0; i < ticks; ++i) (void)climb.tick();
  }
  // zmp_margin_before_m: a swing that is put back in the air costs some.
  static void expect_climbed(IdealClimb& climb, double zmp_margin_before_m = 0.0) {
    climb.run(60.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 4U);
    EXPECT_GT(climb.record().zmp_margin_m, std::min(0.0, zmp_margin_before_m - 1e-9));
    for (const double margin_m : climb.record().sole_margin_m) EXPECT_GT(margin_m, 0.0);
  }
};

TEST_P(GaitPause, InEveryPhase_StandsOnBothFeet_AndGoesOnWhenItMay) {
  for (const When& when : kMoments) {
    IdealClimb climb({}, params());
    ASSERT_TRUE(climb.run_until(when.phase, when.swing));
    tick(climb, 40);
    climb.gait().allow_steps(false);
    tick(climb, 1000);
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
    tick(climb, 4000);  // longer than it waits for anything that it sees
    EXPECT_EQ(climb.status().step.sequence, when.last_swing);
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
    climb.gait().allow_steps(true);
    expect_climbed(climb);
  }
}

TEST_P(GaitPause, AgainAndAgain_IsNotUnsteady) {
  IdealClimb climb({}, params());
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  for (int i = 0; i < 40; ++i) {
    climb.gait().allow_steps(false);
    tick(climb, 30);
    climb.gait().allow_steps(true);
    tick(climb, 30);
  }
  expect_climbed(climb);
}

TEST_P(GaitPause, RestartedAfterAStopInEveryPhase_ClimbsOn) {
  for (const When& when : kMoments) {
    IdealClimb climb({}, params());
    ASSERT_TRUE(climb.run_until(when.phase, when.swing));
    tick(climb, 40);
    climb.gait().request_stop(StopReason::kOperator);
    climb.run(20.0);
    ASSERT_EQ(climb.status().phase, GaitPhase::kStopped);
    tick(climb, 500);
    ASSERT_TRUE(climb.gait().try_restart(climb.q_rad()));
    EXPECT_FALSE(climb.gait().stop_requested());
    EXPECT_EQ(climb.status().stop_reason, StopReason::kNone);
    expect_climbed(climb, climb.record().zmp_margin_m);
  }
}

TEST_P(GaitPause, AJointIsElsewhere_RestartsNot) {
  IdealClimb climb({}, params());
  ASSERT_TRUE(climb.run_until(GaitPhase::kDoubleSupport, 2));
  climb.gait().request_stop(StopReason::kOperator);
  climb.run(20.0);
  for (const double off_rad : {0.5, -0.5, std::numeric_limits<double>::quiet_NaN()}) {
    JointVector q_rad = climb.q_rad();
    q_rad[3] += off_rad;
    EXPECT_FALSE(climb.gait().try_restart(q_rad));
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_TRUE(climb.gait().stop_requested());
  }
}

INSTANTIATE_TEST_SUITE_P(Both, GaitPause, testing::Values(GaitPattern::kDoubleStep, GaitPattern::kSingleStep),
                         [](const auto& pattern) {
                           return pattern.param == GaitPattern::kDoubleStep ? "double" : "single";
                         });

}  // namespace
}  // namespace polygmap
