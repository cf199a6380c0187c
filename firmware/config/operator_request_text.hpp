// SPDX-License-Identifier: Apache-2.0
// What an operator asks, in words: "start", or "go_to=AHEAD,LEFT", "go_to=AHEAD,LEFT,TURN" and
// "go_to=AHEAD,LEFT,TURN,UP" in metres and degrees, TURN empty where any heading will do. Outside the module.
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
    "arm, start, go_to=AHEAD,LEFT[,[TURN][,UP]] in metres (50 at most) and degrees (183 at most), pause, resume, stop, "
    "reset, hand_over";
static_assert(Destination::kFarthest_m == 50.0);

[[nodiscard]] inline std::optional<Destination> destination_of(std::string_view numbers) noexcept {
  constexpr std::size_t kTurn = 2, kUp = 3;
  std::array<double, 4> values{};
  bool has_turn = true;
  std::size_t count = 0;
  for (const char *at = numbers.data(), *const last = at + numbers.size(); count < values.size(); ++at) {
    if (count == kTurn && at != last && *at == ',') {
      has_turn = false;
    } else {
      const auto [end, error] = std::from_chars(at, last, values[count]);
      if (error != std::errc{}) return std::nullopt;
      at = end;
    }
    ++count;
    if (at == last) break;
    if (*at != ',' || count == values.size()) return std::nullopt;
  }
  const Destination to{values[0],   values[1],  values[kTurn] * kPi / 180.0, has_turn && count > kTurn,
                       values[kUp], count > kUp};
  return count >= kTurn && to.is_valid() ? std::optional(to) : std::nullopt;
}

[[nodiscard]] inline std::optional<OperatorRequest> operator_request_of(std::string_view text) noexcept {
  const std::size_t equals = text.find('=');
  const auto command = operator_command_of(text.substr(0, equals));
  if (!command || (*command == OperatorCommand::kGoTo) == (equals == std::string_view::npos)) return std::nullopt;
  if (*command != OperatorCommand::kGoTo) return OperatorRequest(*command);
  const std::optional<Destination> to = destination_of(text.substr(equals + 1));
  return to ? std::optional(OperatorRequest(*to)) : std::nullopt;
}

// As few digits as give the same turn: 30 degrees, in radians and back, are 29.999999999999996.
[[nodiscard]] inline std::to_chars_result degrees_of(double turn_rad, char* first, char* last) noexcept {
  std::to_chars_result printed{};
  double degrees = 0.0;
  for (int digits = 6; digits <= 17; ++digits) {
    printed = std::to_chars(first, last, turn_rad * 180.0 / kPi, std::chars_format::general, digits);
    std::from_chars(first, printed.ptr, degrees);
    if (degrees * kPi / 180.0 == turn_rad) break;
  }
  return printed;
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
  if (to.has_turn) add(',', degrees_of(to.turn_rad, first, last));
  if (!to.has_height) return text;
  if (!to.has_turn) text += ',';
  add(',', std::to_chars(first, last, to.up_m));
  return text;
}

}  // namespace polygmap
