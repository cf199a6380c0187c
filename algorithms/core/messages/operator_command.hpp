// SPDX-License-Identifier: Apache-2.0
// What the operator may ask of the module.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace polygmap {

enum class OperatorCommand : std::uint8_t {
  kArm,       // take the robot over, and stand
  kStart,     // walk up and climb
  kPause,     // the foot in the air comes down, then stand
  kResume,    // go on
  kStop,      // the foot in the air comes down, then end
  kReset,     // after an end whose cause is over: stand, and be ready to start
  kHandOver,  // let go of a robot that stands, for another controller
  kGoTo,      // walk and climb to a place, and end there
};
inline constexpr std::array<std::string_view, 8> kOperatorCommandNames{"arm",  "start", "pause",     "resume",
                                                                       "stop", "reset", "hand_over", "go_to"};
static_assert(kOperatorCommandNames.size() == static_cast<std::size_t>(OperatorCommand::kGoTo) + 1);

[[nodiscard]] constexpr std::string_view name_of(OperatorCommand command) noexcept {
  const auto i = static_cast<std::size_t>(command);
  return i < kOperatorCommandNames.size() ? kOperatorCommandNames[i] : "unknown";
}
[[nodiscard]] constexpr std::optional<OperatorCommand> operator_command_of(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kOperatorCommandNames.size(); ++i) {
    if (kOperatorCommandNames[i] == name) return static_cast<OperatorCommand>(i);
  }
  return std::nullopt;
}

// Where to, seen from the middle between the feet as they stand when it is asked: in their heading, ahead and to the
// left. It has no height: of floors above each other any will do.
struct Destination {
  static constexpr double kFarthest_m = 50.0;
  double ahead_m = 0.0;
  double left_m = 0.0;
  double turn_rad = 0.0;    // to the left, of the heading there against the present one
  bool has_turn = false;    // false: any heading will do
  double up_m = 0.0;        // of the ground there above the present one
  bool has_height = false;  // false: any storey will do

  [[nodiscard]] bool is_valid() const noexcept {
    const auto within = [](double x, double most) { return x >= -most && x <= most; };  // false for NaN, too
    return within(ahead_m, kFarthest_m) && within(left_m, kFarthest_m) && within(turn_rad, 3.2) &&
           within(up_m, kFarthest_m);
  }
};

struct OperatorRequest {
  OperatorCommand command{};
  Destination destination;  // of kGoTo

  constexpr OperatorRequest() noexcept = default;
  constexpr OperatorRequest(OperatorCommand asked) noexcept : command(asked) {}  // NOLINT: a command is a request
  constexpr explicit OperatorRequest(const Destination& to) noexcept
      : command(OperatorCommand::kGoTo), destination(to) {}
};

}  // namespace polygmap
