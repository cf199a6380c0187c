// SPDX-License-Identifier: Apache-2.0
#include "firmware/supervisor.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "algorithms/core/math/transform.hpp"
#include "hal/ports/joint_bus.hpp"

namespace polygmap {
namespace {

using Command = OperatorCommand;
constexpr std::array kCommands{Command::kArm,  Command::kStart, Command::kPause,    Command::kResume,
                               Command::kStop, Command::kReset, Command::kHandOver, Command::kGoTo};

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
      {ModuleState::kOff, "yes no no no no no no no"},         {ModuleState::kArming, "no no no no yes no no no"},
      {ModuleState::kStanding, "no yes no no yes no yes yes"}, {ModuleState::kWalkingUp, "no no yes no yes no no yes"},
      {ModuleState::kClimbing, "no no yes no yes no no yes"},  {ModuleState::kHolding, "no no no yes yes no no no"},
      {ModuleState::kStopping, "no no no no no no no no"},     {ModuleState::kSafeStop, "no no no no no yes yes no"},
      {ModuleState::kOnTop, "no no no no yes yes yes yes"},    {ModuleState::kFallen, "no no no no no no no no"},
      {ModuleState::kHandingOver, "no no no no yes no no no"}, {ModuleState::kReleased, "no no no no no no no no"}};
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

// A supervisor in a state, and the gait that it sees there.
struct Case {
  Supervisor supervisor;
  Supervisor::GaitView gait = kUnarmed;

  [[nodiscard]] ModuleState state() const { return supervisor.state(gait); }
  // As ControlLane does.
  void ask(Command command) {
    const ModuleState before = state();
    const bool ends = command == Command::kStop && before != ModuleState::kArming;
    const bool stands_on = command == Command::kHandOver && before == ModuleState::kStanding;
    if (ends || stands_on) gait.stop_requested = true;
    if (stands_on) gait.phase = GaitPhase::kStopped;  // at once: no foot is in the air
    const bool goes_on = command == Command::kGoTo && before == ModuleState::kOnTop;
    if (command == Command::kReset || goes_on) gait.phase = GaitPhase::kStandstill, gait.stop_requested = false;
    supervisor.obey(command, before);
  }
  void happen(StateEvent event) {
    switch (event) {
      case StateEvent::kArms:
        gait.armed = true;
        break;
      case StateEvent::kStepsOntoTread:
      case StateEvent::kStepsOnFloor:
        gait.on_stairs = event == StateEvent::kStepsOntoTread;
        break;
      case StateEvent::kHasToStop:
        gait.stop_requested = true;
        break;
      case StateEvent::kGaitStops:
        gait.phase = GaitPhase::kStopped;
        break;
      case StateEvent::kGaitEnds:
        gait.phase = GaitPhase::kFinished;
        break;
      case StateEvent::kFalls:
        for (int i = 0; i < 100; ++i) supervisor.watch_lean({}, rotation_zyx(0.0, 1.0, 0.0));
        break;
      case StateEvent::kLetsGo:
        if (supervisor.hands_over()) supervisor.let_go();
        break;
    }
  }
};
Case case_in(ModuleState state) {
  Case c{supervisor_of(false)};
  if (state == ModuleState::kOff) return c;
  c.ask(Command::kArm);
  if (state == ModuleState::kArming) return c;
  c.happen(StateEvent::kArms);
  if (state == ModuleState::kStanding) return c;
  c.ask(Command::kStart);
  if (state == ModuleState::kClimbing || state == ModuleState::kOnTop) c.happen(StateEvent::kStepsOntoTread);
  if (state == ModuleState::kHolding) c.ask(Command::kPause);
  if (state == ModuleState::kStopping) c.ask(Command::kStop);
  if (state == ModuleState::kSafeStop) c.happen(StateEvent::kGaitStops);
  if (state == ModuleState::kOnTop) c.happen(StateEvent::kGaitEnds);
  if (state == ModuleState::kFallen) c.happen(StateEvent::kFalls);
  if (state == ModuleState::kHandingOver || state == ModuleState::kReleased) {
    c.happen(StateEvent::kGaitStops);
    c.ask(Command::kHandOver);
  }
  if (state == ModuleState::kReleased) c.happen(StateEvent::kLetsGo);
  return c;
}

TEST(Supervisor, EveryTransitionOfTheOperators_LeadsWhereTheTableSays) {
  for (const OperatorTransition& t : kOperatorTransitions) {
    Case c = case_in(t.from);
    ASSERT_EQ(c.state(), t.from);
    c.ask(t.command);
    EXPECT_EQ(c.state(), t.to) << name_of(t.from) << " " << name_of(t.command);
  }
}

TEST(Supervisor, EveryEventInEveryState_LeadsWhereTheTableSaysAndElseNowhere) {
  using State = ModuleState;
  using Event = StateEvent;
  // A gait that may not step ends nothing; one that has ended has no event but those of the table; before it has its
  // commands, neither gait nor lean is looked at.
  const auto cannot_be = [](State state, Event event) {
    const bool is_unarmed = state == State::kOff || state == State::kArming;
    const bool lets_go = state == State::kHandingOver || state == State::kReleased;
    const bool is_over = state == State::kSafeStop || state == State::kOnTop || lets_go;
    if (event == Event::kGaitEnds) {
      return is_unarmed || is_over || state == State::kStanding || state == State::kHolding;
    }
    if (is_unarmed) return event == Event::kFalls || (event == Event::kArms && state == State::kOff);
    return event == Event::kGaitStops && is_over;
  };
  for (std::size_t from = 0; from < kModuleStateTable.size(); ++from) {
    for (std::size_t what = 0; what <= static_cast<std::size_t>(Event::kLetsGo); ++what) {
      const auto state = static_cast<State>(from);
      const auto event = static_cast<Event>(what);
      if (cannot_be(state, event)) continue;
      State expected = state;
      for (const AutomaticTransition& t : kAutomaticTransitions) {
        if (t.from == state && t.event == event) expected = t.to;
      }
      Case c = case_in(state);
      ASSERT_EQ(c.state(), state) << name_of(state);
      c.happen(event);
      EXPECT_EQ(c.state(), expected) << name_of(state) << ": " << text_of(event);
    }
  }
}

TEST(Supervisor, Autostart_WalksUpOnceItHasArmed) {
  Case c{supervisor_of(true)};
  ASSERT_EQ(c.state(), ModuleState::kArming);
  c.happen(StateEvent::kArms);
  EXPECT_EQ(c.state(), ModuleState::kWalkingUp);
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

TEST(Supervisor, DriveTellsItsTemperature_IsTooHotFromOneToTheOther) {
  const Supervisor::Params params;
  std::array<std::int16_t, kJointCount> degc = hal::all_not_told_degc();
  JointSet hot;
  const auto tells = [&](int told) {
    degc[3] = static_cast<std::int16_t>(told);
    return (hot = Supervisor::hot(params, degc, hot)).bits();
  };
  constexpr std::uint32_t kNone = 0, kKnee = 1U << 3U;
  EXPECT_EQ(tells(kNotTold_degc), kNone);
  EXPECT_EQ(tells(params.hot_degc - 1), kNone);
  EXPECT_EQ(tells(params.hot_degc), kKnee);
  EXPECT_EQ(tells(params.cool_degc + 1), kKnee);
  EXPECT_EQ(tells(kNotTold_degc), kKnee) << "it says nothing of having cooled";
  EXPECT_EQ(tells(params.cool_degc), kNone);
  EXPECT_EQ(tells(params.hot_degc - 1), kNone);
}

TEST(OperatorCommand, NamesAreRead_AndNothingElse) {
  for (const Command command : kCommands) EXPECT_EQ(operator_command_of(name_of(command)), command);
  for (const std::string_view wrong : {"", "Arm", "arm ", "go", "stopp"}) EXPECT_FALSE(operator_command_of(wrong));
}

}  // namespace
}  // namespace polygmap
