// SPDX-License-Identifier: Apache-2.0
#include "firmware/supervisor.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "algorithms/core/math/transform.hpp"

namespace polygmap {
namespace {

using Command = OperatorCommand;
constexpr std::array kCommands{Command::kArm,    Command::kStart, Command::kPause,
                               Command::kResume, Command::kStop,  Command::kReset};

Supervisor supervisor_of(bool autostart) {
  Supervisor::Params params;
  params.autostart = autostart;
  Supervisor supervisor;
  supervisor.reset(params);
  return supervisor;
}
constexpr Supervisor::GaitView kUnarmed{false, GaitPhase::kStandstill, false, false};
constexpr Supervisor::GaitView kOnTheFloor{true, GaitPhase::kSwing, false, false};
constexpr Supervisor::GaitView kOnTheStairs{true, GaitPhase::kSwing, false, true};
constexpr Supervisor::GaitView kStopped{true, GaitPhase::kStopped, true, true};

TEST(Supervisor, EveryCommandInEveryState_IsObeyedWhereItMeansSomething) {
  // In the order of kCommands.
  const std::vector<std::pair<ModuleState, std::string>> obeyed{
      {ModuleState::kOff, "yes no no no no no"},       {ModuleState::kArming, "no no no no yes no"},
      {ModuleState::kStanding, "no yes no no yes no"}, {ModuleState::kWalkingUp, "no no yes no yes no"},
      {ModuleState::kClimbing, "no no yes no yes no"}, {ModuleState::kHolding, "no no no yes yes no"},
      {ModuleState::kStopping, "no no no no no no"},   {ModuleState::kSafeStop, "no no no no no yes"},
      {ModuleState::kOnTop, "no no no no yes yes"},    {ModuleState::kFallen, "no no no no no no"}};
  ASSERT_EQ(obeyed.size(), kModuleStateTable.size());
  for (const auto& [state, expected] : obeyed) {
    std::string answers;
    for (const Command command : kCommands) {
      answers += std::string(answers.empty() ? "" : " ") + (Supervisor::answers(state, command) ? "yes" : "no");
    }
    EXPECT_EQ(answers, expected) << name_of(state);
  }
}

TEST(Supervisor, WithoutAutostart_EachStateWaitsForItsCommand) {
  Supervisor supervisor = supervisor_of(false);
  const auto ask = [&](Command command, const Supervisor::GaitView& gait) {
    const ModuleState state = supervisor.state(gait);
    if (Supervisor::answers(state, command)) supervisor.obey(command, state);
    return Supervisor::answers(state, command);
  };
  EXPECT_EQ(supervisor.state(kUnarmed), ModuleState::kOff);
  EXPECT_FALSE(supervisor.may_arm());
  EXPECT_TRUE(ask(Command::kArm, kUnarmed));
  EXPECT_TRUE(supervisor.may_arm());
  EXPECT_EQ(supervisor.state(kUnarmed), ModuleState::kArming);
  EXPECT_EQ(supervisor.state(kOnTheFloor), ModuleState::kStanding);
  EXPECT_FALSE(supervisor.may_step());
  EXPECT_TRUE(ask(Command::kStart, kOnTheFloor));
  EXPECT_TRUE(supervisor.may_step());
  EXPECT_EQ(supervisor.state(kOnTheFloor), ModuleState::kWalkingUp);
  EXPECT_EQ(supervisor.state(kOnTheStairs), ModuleState::kClimbing);
  EXPECT_TRUE(ask(Command::kPause, kOnTheStairs));
  EXPECT_FALSE(supervisor.may_step());
  EXPECT_EQ(supervisor.state(kOnTheStairs), ModuleState::kHolding);
  EXPECT_FALSE(ask(Command::kStart, kOnTheStairs)) << "it goes on with resume";
  EXPECT_FALSE(supervisor.may_step());
  EXPECT_TRUE(ask(Command::kResume, kOnTheStairs));
  EXPECT_EQ(supervisor.state(kOnTheStairs), ModuleState::kClimbing);
  EXPECT_TRUE(ask(Command::kPause, kOnTheStairs));
  EXPECT_TRUE(ask(Command::kReset, kStopped));
  EXPECT_EQ(supervisor.state(kOnTheStairs), ModuleState::kStanding) << "nothing of the pause is left";
  EXPECT_TRUE(ask(Command::kStart, kOnTheStairs));
  EXPECT_EQ(supervisor.state(kOnTheStairs), ModuleState::kClimbing);
}

TEST(Supervisor, StopWhileItArms_IsOffAgain) {
  Supervisor supervisor = supervisor_of(true);
  EXPECT_EQ(supervisor.state(kUnarmed), ModuleState::kArming);
  supervisor.obey(Command::kStop, ModuleState::kArming);
  EXPECT_EQ(supervisor.state(kUnarmed), ModuleState::kOff);
  EXPECT_FALSE(supervisor.may_arm());
}

TEST(Supervisor, LeansTooFarForTooLong_HasFallenForGood) {
  const Supervisor::Params params;
  Supervisor supervisor = supervisor_of(true);
  const auto lean = [&](double rad, int ticks) {
    for (int i = 0; i < ticks; ++i) supervisor.watch_lean(params, rotation_zyx(1.0, rad, 0.0));
  };
  lean(params.fallen_rad - 0.01, 1000);
  lean(params.fallen_rad + 0.01, params.fallen_ticks - 1);
  lean(0.0, 1);
  lean(-params.fallen_rad - 0.01, params.fallen_ticks - 1);
  EXPECT_FALSE(supervisor.has_fallen());
  lean(-params.fallen_rad - 0.01, 1);
  EXPECT_TRUE(supervisor.has_fallen());
  lean(0.0, 1000);
  EXPECT_EQ(supervisor.state(kOnTheStairs), ModuleState::kFallen);
}

TEST(OperatorCommand, NamesAreRead_AndNothingElse) {
  for (const Command command : kCommands) EXPECT_EQ(operator_command_of(name_of(command)), command);
  for (const std::string_view wrong : {"", "Arm", "arm ", "go", "stopp"}) EXPECT_FALSE(operator_command_of(wrong));
}

}  // namespace
}  // namespace polygmap
