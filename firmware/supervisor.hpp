// SPDX-License-Identifier: Apache-2.0
// The module's states, what its operator may ask in which of them, and whether the robot has fallen.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/math/transcendental.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/operator_command.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

enum class ModuleState : std::uint8_t {
  kOff,
  kArming,
  kStanding,
  kWalkingUp,
  kClimbing,
  kHolding,
  kStopping,
  kSafeStop,
  kOnTop,
  kFallen,
  kHandingOver,
  kReleased,
};
// One line for each state, in the enumeration's order: its name, and what the module does in it.
struct ModuleStateInfo {
  std::string_view name;
  std::string_view text;
};
inline constexpr std::array kModuleStateTable{
    ModuleStateInfo{"off", "Its commands have no gains and no torques; it waits to be armed."},
    ModuleStateInfo{"arming", "The same commands, until every drive and sensor has answered and IMU and legs agree."},
    ModuleStateInfo{"standing", "The gait commands the joints and balances; it waits to be started."},
    ModuleStateInfo{"walking_up", "It looks for stairs, and steps on the floor; or walks to its goal."},
    ModuleStateInfo{"climbing", "It has begun to step onto treads."},
    ModuleStateInfo{"holding", "Paused: a foot in the air comes down as planned, and then it stands."},
    ModuleStateInfo{"stopping", "It was asked to stop, or has to: a foot in the air comes down first."},
    ModuleStateInfo{"safe_stop", "The gait has stopped on two feet and holds; the stop's reason says why."},
    ModuleStateInfo{"on_top", "The gait has ended the climb, or is at its goal, and holds."},
    ModuleStateInfo{"fallen", "The joints are damped, and nothing else is asked of them; only a new start leads on."},
    ModuleStateInfo{"handing_over",
                    "It balances until the robot is at rest; then the drives get a law that holds it there."},
    ModuleStateInfo{"released",
                    "Nothing is sent any more: another controller has the robot; only a new start leads on."},
};
static_assert(kModuleStateTable.size() == static_cast<std::size_t>(ModuleState::kReleased) + 1);
[[nodiscard]] constexpr std::string_view name_of(ModuleState state) noexcept {
  return kModuleStateTable[static_cast<std::size_t>(state)].name;
}
// The gait commands the joints, and nobody has asked it to end.
[[nodiscard]] constexpr bool is_running(ModuleState state) noexcept {
  return (state >= ModuleState::kStanding && state <= ModuleState::kHolding) || state == ModuleState::kOnTop;
}

// What a command leads to. What no line has is refused, and counted.
struct OperatorTransition {
  ModuleState from;
  OperatorCommand command;
  ModuleState to;
  std::string_view note = "";  // may follow the state's name
};
inline constexpr auto kOperatorTransitions = std::to_array<OperatorTransition>({
    {ModuleState::kOff, OperatorCommand::kArm, ModuleState::kArming},
    {ModuleState::kArming, OperatorCommand::kStop, ModuleState::kOff},
    {ModuleState::kStanding, OperatorCommand::kStart, ModuleState::kWalkingUp, ", or climbing where it was"},
    {ModuleState::kStanding, OperatorCommand::kGoTo, ModuleState::kWalkingUp, ", or climbing where it was"},
    {ModuleState::kStanding, OperatorCommand::kStop, ModuleState::kStopping},
    {ModuleState::kWalkingUp, OperatorCommand::kPause, ModuleState::kHolding},
    {ModuleState::kWalkingUp, OperatorCommand::kGoTo, ModuleState::kWalkingUp},
    {ModuleState::kWalkingUp, OperatorCommand::kStop, ModuleState::kStopping},
    {ModuleState::kClimbing, OperatorCommand::kPause, ModuleState::kHolding},
    {ModuleState::kClimbing, OperatorCommand::kGoTo, ModuleState::kClimbing},
    {ModuleState::kClimbing, OperatorCommand::kStop, ModuleState::kStopping},
    {ModuleState::kHolding, OperatorCommand::kResume, ModuleState::kWalkingUp, ", or climbing where it was"},
    {ModuleState::kHolding, OperatorCommand::kStop, ModuleState::kStopping},
    {ModuleState::kSafeStop, OperatorCommand::kReset, ModuleState::kStanding, ", once what stopped it is over"},
    {ModuleState::kOnTop, OperatorCommand::kReset, ModuleState::kStanding},
    {ModuleState::kOnTop, OperatorCommand::kGoTo, ModuleState::kClimbing, ", or walking_up where it was"},
    {ModuleState::kOnTop, OperatorCommand::kStop, ModuleState::kSafeStop},
    {ModuleState::kStanding, OperatorCommand::kHandOver, ModuleState::kHandingOver},
    {ModuleState::kSafeStop, OperatorCommand::kHandOver, ModuleState::kHandingOver, ", if it balances"},
    {ModuleState::kOnTop, OperatorCommand::kHandOver, ModuleState::kHandingOver},
    {ModuleState::kHandingOver, OperatorCommand::kStop, ModuleState::kSafeStop},
});

// What happens without an operator.
enum class StateEvent : std::uint8_t {
  kArms,
  kStepsOntoTread,
  kStepsOnFloor,
  kHasToStop,
  kGaitStops,
  kGaitEnds,
  kFalls,
  kLetsGo
};
[[nodiscard]] constexpr std::string_view text_of(StateEvent event) noexcept {
  constexpr std::array<std::string_view, 8> kTexts{
      "all drives and sensors have answered, and agree",
      "a foot is lifted for a tread",
      "a foot is lifted for the floor: one was put back, or it is past the stairs",
      "it has to stop: time is short, commands are refused, a drive errs or is too hot",
      "the gait has stopped, on both feet",
      "the gait has ended the climb, or is at the place it was sent to",
      "the torso leans too far for too long",
      "it was at rest, and the drives hold it"};
  static_assert(kTexts.size() == static_cast<std::size_t>(StateEvent::kLetsGo) + 1);
  return kTexts[static_cast<std::size_t>(event)];
}
// What an event leads to. What no line has changes nothing.
struct AutomaticTransition {
  ModuleState from;
  StateEvent event;
  ModuleState to;
  std::string_view note = "";  // may follow the state's name
};
inline constexpr auto kAutomaticTransitions = std::to_array<AutomaticTransition>({
    {ModuleState::kArming, StateEvent::kArms, ModuleState::kStanding, ", or walking_up by itself with autostart"},
    {ModuleState::kStanding, StateEvent::kHasToStop, ModuleState::kStopping},
    {ModuleState::kStanding, StateEvent::kGaitStops, ModuleState::kSafeStop},
    {ModuleState::kStanding, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kWalkingUp, StateEvent::kStepsOntoTread, ModuleState::kClimbing},
    {ModuleState::kWalkingUp, StateEvent::kHasToStop, ModuleState::kStopping},
    {ModuleState::kWalkingUp, StateEvent::kGaitStops, ModuleState::kSafeStop},
    {ModuleState::kWalkingUp, StateEvent::kGaitEnds, ModuleState::kOnTop},
    {ModuleState::kWalkingUp, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kClimbing, StateEvent::kStepsOnFloor, ModuleState::kWalkingUp},
    {ModuleState::kClimbing, StateEvent::kHasToStop, ModuleState::kStopping},
    {ModuleState::kClimbing, StateEvent::kGaitStops, ModuleState::kSafeStop},
    {ModuleState::kClimbing, StateEvent::kGaitEnds, ModuleState::kOnTop},
    {ModuleState::kClimbing, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kHolding, StateEvent::kHasToStop, ModuleState::kStopping},
    {ModuleState::kHolding, StateEvent::kGaitStops, ModuleState::kSafeStop},
    {ModuleState::kHolding, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kStopping, StateEvent::kGaitStops, ModuleState::kSafeStop},
    {ModuleState::kStopping, StateEvent::kGaitEnds, ModuleState::kSafeStop},
    {ModuleState::kStopping, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kSafeStop, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kOnTop, StateEvent::kHasToStop, ModuleState::kSafeStop},
    {ModuleState::kOnTop, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kHandingOver, StateEvent::kFalls, ModuleState::kFallen},
    {ModuleState::kHandingOver, StateEvent::kLetsGo, ModuleState::kReleased},
});

class Supervisor {
 public:
  struct Params {
    bool autostart = true;
    double fallen_rad = 0.45;
    std::int32_t fallen_ticks = 10;
    std::int32_t hot_degc = 90;
    std::int32_t cool_degc = 75;

    static void visit(auto& p, auto& field) {
      field("autostart", p.autostart, "It arms and starts by itself; false: when its operator asks.");
      // 2026-11-27, 80 climbs under physics, most of them pushed by 10 to 15 N s or at reality 2: of those that stood
      // at the end none leaned by more than 0.153 rad.
      field("fallen_rad", p.fallen_rad, 0.2, 1.5,
            "A torso that leans farther falls: the joints are damped from then on.");
      field("fallen_ticks", p.fallen_ticks, 1, 500, "So many ticks in a row.");
      field("hot_degc", p.hot_degc, 30, 256,
            "A drive that tells of such a temperature or more is too hot: it stops. Let it be less than what the drive "
            "itself switches off at; 256, which no drive can tell: never.");
      field("cool_degc", p.cool_degc, 20, 255, "It is too hot until it tells of such a temperature or less.");
    }
  };
  // What the state follows from, beside what was asked.
  struct GaitView {
    bool armed;
    GaitPhase phase;
    bool stop_requested;
    bool on_stairs;  // it has begun to step onto treads
  };

  void reset(const Params& params) noexcept {
    *this = {};
    armed_ = started_ = params.autostart;
  }
  [[nodiscard]] static bool answers(ModuleState state, OperatorCommand command) noexcept {
    const auto is_this = [=](const OperatorTransition& t) { return t.from == state && t.command == command; };
    return std::ranges::any_of(kOperatorTransitions, is_this);
  }
  // In a state that answers the command. What of the gait is asked to stop, or to begin anew, the caller does.
  void obey(OperatorCommand command, ModuleState state) noexcept {
    if (command == OperatorCommand::kArm) armed_ = true;
    if (command == OperatorCommand::kStop && state == ModuleState::kArming) armed_ = false;
    if (command == OperatorCommand::kStart || command == OperatorCommand::kGoTo) started_ = true;
    if (command == OperatorCommand::kReset) started_ = false;
    hands_over_ = command == OperatorCommand::kHandOver;
    paused_ = command == OperatorCommand::kPause;
  }
  // Every tick in which the estimate hears of the IMU.
  void watch_lean(const Params& params, const Mat3& odom_R_base) noexcept {
    leaning_ticks_ = odom_R_base(2, 2) < math::cos(params.fallen_rad) ? leaning_ticks_ + 1 : 0;
    fallen_ = fallen_ || leaning_ticks_ >= params.fallen_ticks;
  }
  // before: those that were. What a drive does not tell any more it still is; it cools below hot_degc at least.
  [[nodiscard]] static JointSet hot(const Params& params, const std::array<std::int16_t, kJointCount>& degc,
                                    JointSet before) noexcept {
    const std::int32_t cool_degc = std::min(params.cool_degc, params.hot_degc - 1);
    JointSet hot;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const bool was = before.contains(n);
      if (was ? degc[n] > cool_degc || degc[n] == kNotTold_degc : degc[n] >= params.hot_degc) hot.insert(n);
    }
    return hot;
  }
  [[nodiscard]] bool may_arm() const noexcept { return armed_; }
  [[nodiscard]] bool may_step() const noexcept { return started_ && !paused_; }
  [[nodiscard]] bool has_fallen() const noexcept { return fallen_; }
  // Until it has let go, or fallen.
  [[nodiscard]] bool hands_over() const noexcept { return hands_over_ && !released_ && !fallen_; }
  void let_go() noexcept { released_ = true; }
  [[nodiscard]] bool has_let_go() const noexcept { return released_; }

  [[nodiscard]] ModuleState state(const GaitView& gait) const noexcept {
    if (released_) return ModuleState::kReleased;
    if (fallen_) return ModuleState::kFallen;
    if (!gait.armed) return armed_ ? ModuleState::kArming : ModuleState::kOff;
    if (hands_over_) return ModuleState::kHandingOver;
    const bool over = gait.phase == GaitPhase::kFinished;
    if (gait.phase == GaitPhase::kStopped || (over && gait.stop_requested)) return ModuleState::kSafeStop;
    if (over) return ModuleState::kOnTop;
    if (gait.stop_requested) return ModuleState::kStopping;
    if (!started_) return ModuleState::kStanding;
    if (paused_) return ModuleState::kHolding;
    return gait.on_stairs ? ModuleState::kClimbing : ModuleState::kWalkingUp;
  }

 private:
  bool armed_ = false;    // it is to
  bool started_ = false;  // so is this
  bool paused_ = false;
  bool fallen_ = false;
  bool hands_over_ = false;
  bool released_ = false;  // for good
  std::int32_t leaning_ticks_ = 0;
};

}  // namespace polygmap
