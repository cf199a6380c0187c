// SPDX-License-Identifier: Apache-2.0
// The answer to an operator's command in words, for whoever asked. Outside the module.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include "algorithms/core/messages/operator_answer.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "firmware/supervisor.hpp"

namespace polygmap {

inline constexpr std::string_view kRefusedAnswer = "refused: ";  // begins the answer to a command that does nothing

struct AnswerText {
  std::array<char, 384> text{};  // every joint's name finds room
  std::size_t length = 0;

  constexpr void add(std::string_view more) noexcept {
    const std::size_t count = std::min(more.size(), text.size() - length);
    std::copy_n(more.begin(), count, text.begin() + static_cast<std::ptrdiff_t>(length));
    length += count;
  }
  [[nodiscard]] constexpr std::string_view view() const noexcept { return {text.data(), length}; }
};

// As "standing", "refused: off" or "refused: safe_stop, no answer yet from left_knee". state: after the command.
[[nodiscard]] constexpr AnswerText text_of(const OperatorAnswer& answer, ModuleState state) noexcept {
  AnswerText out;
  if (!answer.is_obeyed()) out.add(kRefusedAnswer);
  out.add(name_of(state));
  if (text_of(answer.refusal).empty()) return out;
  out.add(", ");
  out.add(text_of(answer.refusal));
  std::string_view between = " ";
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (!answer.joints.contains(n)) continue;
    out.add(between);
    out.add(kJointNames[n]);
    between = ", ";
  }
  return out;
}

}  // namespace polygmap
