// SPDX-License-Identifier: Apache-2.0
// What an operator asks of a robot under physics: to go on after a long pause, and after a drive was silent.
#include <gtest/gtest.h>

#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

using Command = OperatorCommand;

class OperatedPhysics : public testing::TestWithParam<GaitPattern> {
 protected:
  static Params params() {
    Params params;
    params.gait.planner.pattern = GetParam();
    return params;
  }
  static SimOptions stairs() {
    SimOptions options = stairs_of(kSteps, 3);
    options.start = StartPose{0.35, 0.0, 0.0};
    return options;
  }
  // The swing that leaves the feet on two treads.
  static std::uint32_t parting_swing() { return GetParam() == GaitPattern::kDoubleStep ? 3 : 2; }
  void ask(Command command, double then_run_s) {
    climb_.operator_input.ask(command);
    climb_.run_on(then_run_s);
  }
  void expect_climbs_on() {
    climb_.run(40.0);
    EXPECT_FALSE(climb_.truth().fell) << climb_.truth().fall_reason;
    EXPECT_EQ(climb_.state(), ModuleState::kOnTop) << text_of(climb_.status().stop_reason);
    EXPECT_EQ(climb_.status().treads_climbed, static_cast<std::uint32_t>(kSteps));
    EXPECT_GE(climb_.sole_margin_min_m(), 0.0);
  }

  static constexpr int kSteps = 3;
  PhysicalClimb climb_{stairs(), params()};
};

// Longer than the planner trusts what it remembers of the rear foot's foothold, which the camera does not see
// meanwhile.
TEST_P(OperatedPhysics, PausedForLongBetweenTwoTreads_ClimbsOn) {
  ASSERT_TRUE(run_to_swing_onto(climb_, parting_swing()));
  ask(Command::kPause, 2.0);
  const auto [left, right] = climb_.truth().step_index;
  EXPECT_TRUE(left >= 0 && right >= 0 && left != right) << left << " " << right;
  climb_.run_on(seconds(params().gait.planner.remembered_ns));
  ASSERT_EQ(climb_.state(), ModuleState::kHolding);
  ASSERT_TRUE(climb_.truth().in_contact[0] && climb_.truth().in_contact[1]);
  EXPECT_EQ(climb_.truth().step_index, (std::array{left, right}));
  ask(Command::kResume, 0.01);
  EXPECT_EQ(climb_.state(), ModuleState::kClimbing);
  const std::uint32_t sequence = climb_.status().step.sequence;
  while (climb_.status().step.sequence == sequence && climb_.tick()) {
  }
  const bool joins_the_other = GetParam() == GaitPattern::kDoubleStep;
  EXPECT_EQ(climb_.status().step.target.last_seen_ns == 0, joins_the_other) << "it steps beside the other foot";
  expect_climbs_on();
}

TEST_P(OperatedPhysics, StoppedOnTop_IsASafeStopThatTheOperatorAskedFor) {
  expect_climbs_on();
  ask(Command::kStop, 0.01);
  EXPECT_EQ(climb_.state(), ModuleState::kSafeStop);
  EXPECT_EQ(climb_.status().stop_reason, StopReason::kOperator);
}

// The knee that carries, while the other foot is in the air.
TEST_P(OperatedPhysics, KneeIsMuteAndAnswersAgain_ClimbsOnAfterAReset) {
  ASSERT_TRUE(run_to_swing_onto(climb_, parting_swing()));
  climb_.run_on(0.3);
  const auto knee = joint_index(other(climb_.status().step.foot), kKnee);
  std::uint16_t silent_cycles = 0;
  JointVector last_q_rad;
  climb_.joints.tamper = [&](JointFeedback& feedback) {
    const auto n = static_cast<Eigen::Index>(knee);
    if (silent_cycles++ == 0) last_q_rad = feedback.q_rad;
    feedback.q_rad[n] = last_q_rad[n];
    feedback.dq_radps[n] = feedback.tau_nm[n] = 0.0;
    feedback.silent_cycles[knee] = silent_cycles;
  };
  climb_.run_on(3.0);
  ASSERT_EQ(climb_.state(), ModuleState::kSafeStop);
  EXPECT_EQ(climb_.status().stop_reason, StopReason::kStateStale);
  ask(Command::kReset, 0.01);
  EXPECT_EQ(climb_.state(), ModuleState::kSafeStop) << "the knee is mute";
  climb_.joints.tamper = nullptr;
  climb_.run_on(0.5);
  EXPECT_EQ(climb_.state(), ModuleState::kSafeStop) << "nobody asked";
  ask(Command::kReset, 1.0);
  ASSERT_EQ(climb_.state(), ModuleState::kStanding);
  ask(Command::kStart, 0.01);
  EXPECT_EQ(climb_.state(), ModuleState::kClimbing);
  expect_climbs_on();
}

INSTANTIATE_TEST_SUITE_P(Gaits, OperatedPhysics, testing::Values(GaitPattern::kDoubleStep, GaitPattern::kSingleStep),
                         [](const auto& pattern) {
                           return pattern.param == GaitPattern::kDoubleStep ? "double" : "single";
                         });

}  // namespace
}  // namespace polygmap::sim
