// SPDX-License-Identifier: Apache-2.0
// Climbs whose operator asks for every part of them.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "firmware/recording/replay.hpp"
#include "sim_stub/host/climb/climb.hpp"

namespace polygmap::sim {
namespace {

using Command = OperatorCommand;

std::string states_of(const ClimbSummary& summary) {
  std::string all;
  for (const StateChange& change : summary.states) all += (all.empty() ? "" : " ") + std::string(name_of(change.state));
  return all;
}

// asked: in the order of time.
ClimbSummary climb_with(ClimbOptions options, const std::vector<TimedCommand>& asked) {
  ScriptedOperator script(asked);
  options.climb_operator = &script;
  options.asked = asked;
  return run_climb(options, {});
}

class OperatedClimb : public testing::TestWithParam<GaitPattern> {};

TEST_P(OperatedClimb, PausedStoppedAndReset_ClimbsToTheTop) {
  ClimbOptions options;
  options.stairs.steps = 3;
  options.gait = GetParam();
  const ClimbSummary summary = climb_with(options, {{1.0, Command::kArm},
                                                    {3.5, Command::kStart},
                                                    {11.0, Command::kPause},
                                                    {14.0, Command::kResume},
                                                    {15.5, Command::kStop},
                                                    {19.0, Command::kReset},
                                                    {20.0, Command::kStart}});
  EXPECT_TRUE(summary.pass) << summary.reason;
  EXPECT_TRUE(states_of(summary).starts_with("arming standing walking_up ")) << states_of(summary);
  EXPECT_TRUE(states_of(summary).ends_with("climbing holding climbing stopping safe_stop standing climbing on_top"))
      << states_of(summary);
  EXPECT_EQ(summary.heap_calls, 0U);
  for (const auto& [name, count] : summary.faults) EXPECT_NE(name, "operator_refused");
}
INSTANTIATE_TEST_SUITE_P(Gaits, OperatedClimb, testing::Values(GaitPattern::kDoubleStep, GaitPattern::kSingleStep));

TEST(OperatedRobot, NothingAsked_StandsOnItsOwnControllerAndTheModuleIsOff) {
  ClimbOptions options;
  options.time_limit_s = 6.0;
  const ClimbSummary summary = climb_with(options, {});
  EXPECT_EQ(states_of(summary), "off");
  EXPECT_FALSE(summary.fell);
  EXPECT_TRUE(summary.footsteps.empty());
  for (const auto& [name, count] : summary.faults) EXPECT_NE(name, "lio_rejected") << "nothing is estimated yet";
}

TEST(OperatedRobot, Recorded_NothingDiffersInTheReplay) {
  const auto directory = std::filesystem::path(testing::TempDir()) / "polygmap_operated_climb";
  std::error_code error;
  std::filesystem::remove_all(directory, error);
  ASSERT_TRUE(std::filesystem::create_directories(directory, error));
  ClimbOptions options;
  options.plant = PlantKind::kKinematic;
  options.record_dir = directory.string();
  options.time_limit_s = 9.0;
  const ClimbSummary summary = climb_with(
      options, {{1.2, Command::kArm}, {1.3, Command::kReset}, {3.0, Command::kStart}, {6.0, Command::kPause}});
  EXPECT_EQ(states_of(summary), "off standing walking_up holding");
  const recording::ReplayResult result = recording::replay(options.record_dir);
  EXPECT_EQ(result.verdict, recording::ReplayVerdict::kSame) << recording::text_of(result);
  std::filesystem::remove_all(directory, error);
}

}  // namespace
}  // namespace polygmap::sim
