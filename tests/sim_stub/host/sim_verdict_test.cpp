// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "sim_stub/host/climb/climb_verdict.hpp"
#include "tests/support/scripted_climb.hpp"

namespace polygmap::sim {
namespace {

TEST(ClimbVerdict, Fall_FailsWithThePlantsReason) {
  ScriptedClimb climb(plain_stairs(2));
  climb.climb_all();
  climb.truth.fell = true;
  climb.truth.fall_reason = "the left foot hit step 2 by 7.1 mm.";
  climb.tick();
  climb.truth.fall_reason = "something later";
  climb.tick();
  const ClimbSummary s = climb.finish();
  EXPECT_TRUE(s.fell);
  EXPECT_FALSE(s.pass);
  EXPECT_EQ(s.reason, "Fell after 2 of 2 steps: the left foot hit step 2 by 7.1 mm.");
}

TEST(ClimbVerdict, HeapCall_Fails) {
  ScriptedClimb climb(plain_stairs(1));
  climb.climb_all();
  RunFigures run;
  run.heap_calls = 3;
  run.heap_first_caller = "polygmap::fuse";
  const ClimbSummary s = climb.report.finish(run);
  EXPECT_FALSE(s.pass);
  EXPECT_EQ(s.heap_calls, 3U);
  EXPECT_EQ(s.reason, "The module called the heap, 3 times in all, first from polygmap::fuse.");
}

TEST(ClimbVerdict, ModuleStopped_NamesWhatItMeasured) {
  ScriptedClimb climb(plain_stairs(2));
  climb.wait(100 * kNsPerMs);
  climb.gait.phase = GaitPhase::kStopped;
  climb.gait.stop_reason = StopReason::kRiseTooHigh;
  climb.gait.stop_measured_m = 0.498;
  climb.tick();
  const ClimbSummary s = climb.finish();
  EXPECT_FALSE(s.pass);
  EXPECT_EQ(s.reason,
            "The module stopped after 0 of 2 steps: the next surface that it saw was too high to step on (0.498 m).");
  EXPECT_TRUE(std::isnan(s.climb_time_s));
  EXPECT_TRUE(std::isnan(s.swing_clearance_min_m));  // nothing swung
}

TEST(ClimbVerdict, StoppedBeforeADrop_NamesItsDepth) {
  ScriptedClimb climb(plain_stairs(2));
  climb.wait(100 * kNsPerMs);
  climb.gait.phase = GaitPhase::kStopped;
  climb.gait.stop_reason = StopReason::kDropTooDeep;
  climb.gait.stop_measured_m = 0.451;
  climb.tick();
  EXPECT_EQ(climb.finish().stop_sentence, "the next surface that it saw was too far down to step on (0.451 m)");
}

TEST(ClimbVerdict, StoppedBeforeARamp_NamesItsAngle) {
  ScriptedClimb climb(plain_stairs(2));
  climb.wait(100 * kNsPerMs);
  climb.gait.phase = GaitPhase::kStopped;
  climb.gait.stop_reason = StopReason::kTooSteep;
  climb.gait.stop_measured_m = std::tan(9.0 * kPi / 180.0);
  climb.tick();
  EXPECT_EQ(climb.finish().stop_sentence,
            "the ground on the way to its goal sloped too steeply to walk on (9.0 degrees)");
}

// It has ended by itself, 2 m from the world's goal.
std::string reason_where_it_ended(const std::vector<TimedRequest>& asked, ClimbOperator* climb_operator) {
  ClimbSummary s;
  s.options.world.emplace().world.goal.emplace();
  s.options.asked = asked;
  s.options.climb_operator = climb_operator;
  s.route.goal_reached = false;
  s.route.goal_distance_m = 2.0;
  s.route.surfaces_stood_on = {"floor"};
  ClimbEnding ending;
  ending.phase = GaitPhase::kFinished;
  judge(s, ending);
  EXPECT_FALSE(s.pass);
  return s.reason;
}

TEST(ClimbVerdict, EndedFarFromTheGoal_SaysWhatItWasToldToDo) {
  std::ostream nobody(nullptr);
  ScriptedOperator script({}, nobody);
  const std::string after = " after 0 footsteps, on \"floor\", 2.00 m from the goal: it took ";
  const std::string sent = "The module ended" + after + "the place where it stood for the one it was sent to.";
  const std::string climbs = "The module ended the climb" + after + "the tread it stood on for the highest.";
  const TimedRequest start{4.0, OperatorCommand::kStart},
      go_to{5.0, OperatorRequest(Destination{1.0, 0.0, 0.0, false})};
  EXPECT_EQ(reason_where_it_ended({}, nullptr), sent) << "to the world's goal";
  EXPECT_EQ(reason_where_it_ended({start, go_to}, &script), sent);
  EXPECT_EQ(reason_where_it_ended({go_to, start}, &script), climbs);
  EXPECT_EQ(reason_where_it_ended({}, &script), climbs) << "by keys, which send it nowhere";
}

TEST(ClimbVerdict, ImuAndLegsDisagree_SaysWhatToSuspect) {
  ScriptedClimb climb(plain_stairs(2));
  climb.arming_waits_for = {ArmingWait::For::kGravity, {}, 13};
  climb.wait(100 * kNsPerMs);
  const ClimbSummary s = climb.finish();
  EXPECT_EQ(s.ended_by, "module");
  EXPECT_EQ(s.reason,
            "The module did not arm: 13 deg between gravity as the IMU feels it and the soles' normal: suspect the "
            "IMU's mount (imu.base_rpy_rad, robot.mounts.base_R_imu), then both legs' encoders, then the floor.");
}

TEST(ClimbVerdict, RunCutShort_SaysSo) {
  ScriptedClimb climb(plain_stairs(2));
  climb.wait(100 * kNsPerMs);
  EXPECT_EQ(climb.finish().reason, "Time ran out after 0 of 2 steps.");
}

TEST(ClimbVerdict, ModuleTakesTheRobotForFallen_SaysSo) {
  ScriptedClimb climb(plain_stairs(2));
  climb.module_state = ModuleState::kFallen;
  climb.wait(100 * kNsPerMs);
  const ClimbSummary s = climb.finish();
  EXPECT_EQ(s.ended_by, "module");
  EXPECT_EQ(s.reason, "The module took the robot for fallen after 0 of 2 steps, and damped its joints.");
}

TEST(ClimbVerdict, OperatorAsksNoMoreOrLeft_NamesTheState) {
  for (const auto end : {OperatorEnd::kAsksNoMore, OperatorEnd::kLeft}) {
    ScriptedClimb climb(plain_stairs(2));
    climb.module_state = ModuleState::kHolding;
    climb.wait(100 * kNsPerMs);
    RunFigures run;
    run.operator_end = end;
    const ClimbSummary s = climb.report.finish(run);
    EXPECT_EQ(s.ended_by, "operator");
    EXPECT_EQ(s.reason, end == OperatorEnd::kLeft
                            ? "The operator left after 0 of 2 steps; the module's state was holding."
                            : "No command was to come after 0 of 2 steps, and the module waited for one; its state was "
                              "holding.");
  }
}

TEST(ClimbVerdict, StoppedOnTop_PassesAndSaysWhy) {
  ScriptedClimb climb(plain_stairs(1));
  climb.climb_all();
  climb.gait.phase = GaitPhase::kStopped;
  climb.gait.stop_reason = StopReason::kMapStale;
  climb.tick();
  const ClimbSummary s = climb.finish();
  EXPECT_TRUE(s.pass);
  EXPECT_TRUE(s.reason.ends_with("; the module stopped there: its map was stale.")) << s.reason;
}

// No step counts, but not because the module thought itself on top.
TEST(ClimbVerdict, FinishedOverAnEdge_NamesTheEdge) {
  ScriptedClimb climb(plain_stairs(2));
  climb.climb_all({}, 0.07);
  climb.gait.phase = GaitPhase::kFinished;
  climb.tick();
  EXPECT_EQ(climb.finish().reason, "A sole stood 3.2 mm over the edge of its tread; 0 of 2 steps count.");
}

TEST(ClimbVerdict, PushAfterTheEnd_IsNamed) {
  ScriptedClimb climb(plain_stairs(1));
  climb.climb_all();
  RunFigures run;
  run.options.pushes = {{.at_s = 0.01, .axis = 0, .impulse_ns = 10.0}, {.at_s = 99.0, .axis = 1, .impulse_ns = 10.0}};
  const std::string reason = climb.report.finish(run).reason;
  EXPECT_EQ(reason.find("0.01 s never"), std::string::npos) << reason;
  EXPECT_NE(reason.find(" The push at 99 s never came: the run ended at "), std::string::npos) << reason;
}

TEST(VerdictLine, OneLine_WithTheWord) {
  ScriptedClimb climb(plain_stairs(1));
  climb.climb_all();
  const std::string line = verdict_line(climb.finish());
  EXPECT_EQ(line.rfind("PASS: Climbed 1 of 1 steps in 0.9 s", 0), 0U) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace polygmap::sim
