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
};
inline constexpr std::array<std::string_view, 7> kOperatorCommandNames{"arm",  "start", "pause",    "resume",
                                                                       "stop", "reset", "hand_over"};
static_assert(kOperatorCommandNames.size() == static_cast<std::size_t>(OperatorCommand::kHandOver) + 1);

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

}  // namespace polygmap
