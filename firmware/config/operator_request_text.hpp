// SPDX-License-Identifier: Apache-2.0
// What an operator asks, in words: "start", or "go_to=AHEAD,LEFT" and "go_to=AHEAD,LEFT,TURN" in metres and degrees.
// Outside the module.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/messages/operator_command.hpp"

namespace polygmap {

// What may be asked, for who asked for something else.
inline constexpr std::string_view kWhatMayBeAsked =
    "arm, start, go_to=AHEAD,LEFT[,TURN] in metres (50 at most) and degrees (183 at most), pause, resume, stop, reset, "
    "hand_over";
static_assert(Destination::kFarthest_m == 50.0);

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

// operator_request_of() takes it for the same request.
[[nodiscard]] inline std::string text_of(const OperatorRequest& request) {
  std::string text(name_of(request.command));
  if (request.command != OperatorCommand::kGoTo) return text;
  std::array<char, 32> number{};
  const auto add = [&](char before, const std::to_chars_result& printed) {
    text += before;
    text.append(number.data(), printed.ptr);
  };
  char *const first = number.data(), *const last = first + number.size();
  const Destination& to = request.destination;
  add('=', std::to_chars(first, last, to.ahead_m));
  add(',', std::to_chars(first, last, to.left_m));
  if (!to.has_turn) return text;
  // 30 degrees, in radians and back, are 29.999999999999996: as few digits as give the same turn.
  std::to_chars_result printed{};
  double degrees = 0.0;
  for (int digits = 6; digits <= 17; ++digits) {
    printed = std::to_chars(first, last, to.turn_rad * 180.0 / kPi, std::chars_format::general, digits);
    std::from_chars(first, printed.ptr, degrees);
    if (degrees * kPi / 180.0 == to.turn_rad) break;
  }
  add(',', printed);
  return text;
}

}  // namespace polygmap
