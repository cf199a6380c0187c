// SPDX-License-Identifier: Apache-2.0
// What an operator asks, in words: "start", or "go_to=AHEAD,LEFT" and "go_to=AHEAD,LEFT,TURN" in metres and degrees.
// Outside the module.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/messages/operator_command.hpp"

namespace polygmap {

// What may be asked, for who asked for something else.
inline constexpr std::string_view kWhatMayBeAsked =
    "arm, start, go_to=AHEAD,LEFT[,TURN] in metres and degrees, pause, resume, stop, reset, hand_over";

[[nodiscard]] inline std::optional<Destination> destination_of(std::string_view numbers) noexcept {
  std::array<double, 3> values{};
  std::size_t count = 0;
  for (const char *at = numbers.data(), *const last = at + numbers.size(); count < values.size(); ++at) {
    const auto [end, error] = std::from_chars(at, last, values[count]);
    if (error != std::errc{}) return std::nullopt;
    ++count;
    at = end;
    if (at == last) break;
    if (*at != ',' || count == values.size()) return std::nullopt;
  }
  const Destination to{values[0], values[1], values[2] * kPi / 180.0, count == values.size()};
  return count >= 2 && to.is_valid() ? std::optional(to) : std::nullopt;
}

[[nodiscard]] inline std::optional<OperatorRequest> operator_request_of(std::string_view text) noexcept {
  const std::size_t equals = text.find('=');
  const auto command = operator_command_of(text.substr(0, equals));
  if (!command || (*command == OperatorCommand::kGoTo) == (equals == std::string_view::npos)) return std::nullopt;
  if (*command != OperatorCommand::kGoTo) return OperatorRequest(*command);
  const std::optional<Destination> to = destination_of(text.substr(equals + 1));
  return to ? std::optional(OperatorRequest(*to)) : std::nullopt;
}

}  // namespace polygmap
