// SPDX-License-Identifier: Apache-2.0
// The gait under physics, with known footholds: climbs and stops, in both of its patterns.
#include <gtest/gtest.h>

#include <memory>

#include "tests/support/nominal_robot.hpp"
#include "tests/support/physical_climb.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::sim {
namespace {

TEST(PhysicalClimb, WithEverySensorsErrors_ClimbsAndStands) {
  for (const std::uint64_t seed : {1U, 4U}) {
    PhysicalClimb climb(few_steps(seed));
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 2U);
    EXPECT_EQ(climb.truth().step_index[0], 1);
    EXPECT_EQ(climb.truth().step_index[1], 1);
    EXPECT_LT(climb.gait().balance().com_error_m().norm(), 0.02);
  }
}

TEST(PhysicalClimb, SameSeedTwice_RepeatsBitForBit) {
  PhysicalClimb one(few_steps(2)), two(few_steps(2));
  one.run(6.0);
  two.run(6.0);
  EXPECT_EQ(one.truth().true_T_base.p_m, two.truth().true_T_base.p_m);
  EXPECT_GT(one.status().step.sequence, 1U);
}

// Two gaits that differ in nothing but the feedback see the same climb. From a lift-off on the other one's commands are
// sent: the swing is under way, and no reason to stop comes before it ends.
TEST(PhysicalClimb, WithoutFeedbackOfTheDcmFromALiftOffOn_FallsInThatSwing) {
  for (const bool feedback : {true, false}) {
    Gait::Params params;
    if (!feedback) params.balance.dcm.gain = params.balance.dcm.integral_per_s = 0.0;
    const auto other = std::make_unique<Gait>();
    other->reset(params, nominal_robot());
    PhysicalClimb climb(few_steps(4));
    JointCommand its_command;
    bool lifted = false;
    climb.tamper_command = [&](JointCommand& command, const FootholdSet& footholds, const JointFeedback& joints) {
      other->tick(command.stamp_ns, climb.state(), footholds, joints, its_command);
      if (lifted) command = its_command;
    };
    ASSERT_TRUE(run_to_swing_onto(climb, 1));
    lifted = true;
    const std::uint32_t swing = climb.status().step.sequence;
    climb.run(60.0);
    EXPECT_EQ(climb.truth().fell, !feedback) << climb.truth().fall_reason;
    if (feedback) continue;
    EXPECT_EQ(climb.status().step.sequence, swing);
    EXPECT_NE(climb.status().phase, GaitPhase::kStopped);
  }
}

// Rises of the map 10 mm off, more with every stair, and no news: it falls or stops, and does not climb on.
TEST(PhysicalClimb, MapFrozenWithAWrongRise_StopsOrFalls) {
  for (const double per_stair_m : {0.010, -0.010}) {
    SimOptions options;
    options.seed = 2;
    PhysicalClimb climb(options);
    climb.tamper_footholds = [&](FootholdSet& set) {
      const double off_m = per_stair_m * (climb.status().treads_climbed + 1);
      for (Foothold& hold : set.p_star_feet) hold.position_m.z() += off_m;
    };
    climb.run(60.0);
    EXPECT_TRUE(climb.truth().fell || climb.status().phase == GaitPhase::kStopped) << per_stair_m;
  }
}

TEST(PhysicalClimb, OtherBodyOrGroundThanBelieved_ClimbsAllTheSame) {
  struct Variant {
    double mass_scale, offset_x_m, friction;
  };
  for (const Variant& body :
       {Variant{0.9, 0.0, 0.8}, {1.2, 0.0, 0.8}, {1.0, -0.015, 0.8}, {1.0, 0.030, 0.8}, {1.0, 0.0, 0.4}}) {
    if (test::kSlowMachine && body.mass_scale == 1.0) continue;
    SimOptions options = few_steps(2);
    options.mujoco.torso_mass_scale = body.mass_scale;
    options.mujoco.torso_offset_x_m = body.offset_x_m;
    options.mujoco.friction = body.friction;
    PhysicalClimb climb(options);
    climb.run(30.0);
    SCOPED_TRACE(::testing::Message() << body.mass_scale << " " << body.offset_x_m << " " << body.friction);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 2U);
  }
}

TEST(PhysicalStop, RequestedAtAnyPhase_EndsOnBothFeet) {
  for (const double after_s : {0.0, 0.2, 0.45, 0.7, 1.0, 1.2}) {
    if (test::kSlowMachine && after_s != 0.45) continue;
    PhysicalClimb climb(few_steps(2));
    ASSERT_TRUE(run_to_swing_onto(climb, 2));
    climb.run(after_s);
    climb.gait().request_stop();
    climb.run(5.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped) << after_s;
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
    EXPECT_TRUE(stands_for(climb, 3.0)) << after_s << climb.truth().fall_reason;
  }
}

TEST(PhysicalStop, PerceptionLostInSwing_FinishesTheStepsAndStandsOnBothFeet) {
  for (const std::uint32_t nth : {1U, 2U}) {
    PhysicalClimb climb(few_steps(2));
    ASSERT_TRUE(run_to_swing_onto(climb, nth));
    climb.tamper_footholds = [](FootholdSet& set) {
      set.has_p_star = false;
      set.obstruction = StopReason::kNothingSeen;
    };
    climb.run(20.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, StopReason::kNothingSeen);
    EXPECT_EQ(climb.status().treads_climbed, 1U);
    EXPECT_TRUE(stands_for(climb, 3.0)) << climb.truth().fall_reason;
  }
}

TEST(PhysicalStop, StepBeyondTheLegs_StandsOnBothFeetAndSaysSo) {
  PhysicalClimb climb(few_steps(2));
  climb.tamper_footholds = [](FootholdSet& set) {
    for (Foothold& hold : set.p_star_feet) hold.position_m.z() += 0.2;
  };
  climb.run(40.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_TRUE(stands_for(climb, 3.0)) << climb.truth().fall_reason;
}

Gait::Params single_step() {
  Gait::Params params;
  params.planner.pattern = GaitPattern::kSingleStep;
  return params;
}
SimOptions four_steps(std::uint64_t seed) {
  SimOptions options = few_steps(seed);
  options.stairs.steps = 4;
  return options;
}

TEST(PhysicalSingleStep, WithEverySensorsErrors_OneFootOnEveryStepAndBothOnTheLast) {
  for (const std::uint64_t seed : {1U, 4U}) {
    PhysicalClimb climb(four_steps(seed), single_step());
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 4U);
    EXPECT_EQ(climb.truth().step_index[0], 3);
    EXPECT_EQ(climb.truth().step_index[1], 3);
    EXPECT_TRUE(stands_for(climb, 1.0));
  }
}

TEST(PhysicalSingleStep, StopRequestedAtAnyPhase_EndsOnBothFeet) {
  for (const double after_s : {0.0, 0.3, 0.6, 0.9, 1.0, 1.2}) {
    if (test::kSlowMachine && after_s != 0.6) continue;
    PhysicalClimb climb(four_steps(2), single_step());
    ASSERT_TRUE(run_to_swing_onto(climb, 3));
    climb.run(after_s);
    climb.gait().request_stop();
    climb.run(5.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped) << after_s;
    EXPECT_TRUE(stands_for(climb, 3.0)) << after_s << climb.truth().fall_reason;
  }
}

TEST(PhysicalSingleStep, PerceptionLostInSwing_EndsBesideTheFrontFoot) {
  for (const std::uint32_t nth : {1U, 2U, 3U}) {
    PhysicalClimb climb(four_steps(2), single_step());
    ASSERT_TRUE(run_to_swing_onto(climb, nth));
    climb.tamper_footholds = [](FootholdSet& set) {
      set.has_p_star = set.has_p_star_star = false;
      set.obstruction = StopReason::kNothingSeen;
    };
    climb.run(20.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, StopReason::kNothingSeen);
    EXPECT_EQ(climb.status().treads_climbed, nth);
    EXPECT_TRUE(stands_for(climb, 3.0)) << climb.truth().fall_reason;
    EXPECT_EQ(climb.truth().step_index[0], climb.truth().step_index[1]);
  }
}

}  // namespace
}  // namespace polygmap::sim
