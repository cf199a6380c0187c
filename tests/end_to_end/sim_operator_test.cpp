// SPDX-License-Identifier: Apache-2.0
// Climbs whose operator asks for every part of them.
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <string_view>
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
ClimbSummary climb_with(ClimbOptions options, const std::vector<TimedRequest>& asked, std::string* said = nullptr) {
  std::ostringstream out;
  ScriptedOperator script(asked, out);
  options.climb_operator = &script;
  options.asked = asked;
  const ClimbSummary summary = run_climb(options, {});
  if (said != nullptr) *said = out.str();
  return summary;
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
  const ClimbSummary summary = climb_with(options, {{7.0, Command::kArm}});
  EXPECT_EQ(states_of(summary), "off");
  EXPECT_FALSE(summary.fell);
  EXPECT_TRUE(summary.footsteps.empty());
  for (const auto& [name, count] : summary.faults) EXPECT_NE(name, "lio_rejected") << "nothing is estimated yet";
}

struct AskedInVain {
  const char* name;
  std::vector<TimedRequest> asked;
  std::string_view said, state;
};
class OperatorWithNothingMoreToAsk : public testing::TestWithParam<AskedInVain> {};

// Two seconds after the last command, and not when the time is out.
TEST_P(OperatorWithNothingMoreToAsk, ModuleWaits_EndsAndSaysWhatWasRefused) {
  ClimbOptions options;
  options.plant = PlantKind::kKinematic;
  options.time_limit_s = 12.0;
  std::string said;
  const ClimbSummary summary = climb_with(options, GetParam().asked, &said);
  EXPECT_FALSE(summary.pass);
  EXPECT_EQ(summary.ended_by, "operator");
  EXPECT_EQ(summary.reason, "No command was to come after 0 of " + std::to_string(summary.steps_total) +
                                " steps, and the module waited for one; its state was " +
                                std::string(GetParam().state) + ".");
  EXPECT_LT(summary.ended_at_s, GetParam().asked.back().at_s + 3.1);
  EXPECT_NE(said.find(GetParam().said), std::string::npos) << said;
}
INSTANTIATE_TEST_SUITE_P(
    States, OperatorWithNothingMoreToAsk,
    testing::Values(AskedInVain{"off", {{2.0, Command::kStart}}, "    2.00 s  start refused: off\n", "off"},
                    AskedInVain{"standing",
                                {{1.0, Command::kArm}, {3.0, Command::kPause}},
                                "s  standing\n    3.00 s  pause refused: standing\n",
                                "standing"},
                    AskedInVain{"holding",
                                {{1.0, Command::kArm}, {3.0, Command::kStart}, {4.0, Command::kPause}},
                                "s  walking_up\n    4.00 s  holding\n",
                                "holding"}),
    [](const auto& asked) { return asked.param.name; });

TEST(UnaskedRobot, AutostartIsOffAndThereIsNoOperator_EndsAsOff) {
  ClimbOptions options;
  options.plant = PlantKind::kKinematic;
  options.time_limit_s = 12.0;
  options.params.supervisor.autostart = false;
  const ClimbSummary summary = run_climb(options, {});
  EXPECT_EQ(summary.ended_by, "operator");
  EXPECT_LT(summary.ended_at_s, 3.1);
}

TEST(OperatedRobot, HandedOverOnTop_StandsOnItsOwnControllerAgain) {
  ClimbOptions options;
  options.stairs.steps = 1;
  options.bus = config::read_bus(std::string(POLYGMAP_BUSES) + "/damiao.toml");
  options.time_limit_s = 40.0;
  const ClimbSummary summary =
      climb_with(options, {{1.0, Command::kArm}, {3.0, Command::kStart}, {30.0, Command::kHandOver}});
  EXPECT_TRUE(summary.pass) << summary.reason;
  EXPECT_TRUE(summary.reason.ends_with("; it handed the robot over there.")) << summary.reason;
  EXPECT_TRUE(states_of(summary).ends_with("on_top handing_over released")) << states_of(summary);
  EXPECT_NEAR(summary.ended_at_s, 35.6, 0.3);
  for (const auto& [name, count] : summary.faults) EXPECT_NE(name, "drive_silent");
}

TEST(OperatedRobot, Recorded_NothingDiffersInTheReplay) {
  const auto directory = std::filesystem::path(testing::TempDir()) / "polygmap_operated_climb";
  std::error_code error;
  std::filesystem::remove_all(directory, error);
  ASSERT_TRUE(std::filesystem::create_directories(directory, error));
  ClimbOptions options;
  options.plant = PlantKind::kKinematic;
  options.recording = (directory / "run.mcap").string();
  options.record_pictures = true;
  options.time_limit_s = 9.0;
  const ClimbSummary summary = climb_with(options, {{1.2, Command::kArm},
                                                    {1.3, Command::kReset},
                                                    {3.0, Command::kStart},
                                                    {5.0, Command::kPause},
                                                    {6.0, Command::kStop},
                                                    {6.5, Command::kHandOver}});
  EXPECT_TRUE(states_of(summary).starts_with("off standing walking_up holding ")) << states_of(summary);
  EXPECT_TRUE(states_of(summary).ends_with("safe_stop handing_over released")) << states_of(summary);
  const recording::ReplayResult result = recording::replay(options.recording);
  EXPECT_EQ(result.verdict, recording::ReplayVerdict::kSame) << recording::text_of(result);
  std::filesystem::remove_all(directory, error);
}

}  // namespace
}  // namespace polygmap::sim
