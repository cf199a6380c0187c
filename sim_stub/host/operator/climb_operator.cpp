// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/operator/climb_operator.hpp"

#include <charconv>

#include "firmware/config/file_error.hpp"

namespace polygmap::sim {

std::string read_command(const std::string& text, TimedCommand& command) {
  constexpr double kLatest_s = 10000.0;
  const std::size_t at = text.find('@');
  const auto known = operator_command_of(std::string_view(text).substr(0, at));
  double at_s = -1.0;
  if (at != std::string::npos) {
    const char *first = text.data() + at + 1, *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(first, last, at_s);
    if (error != std::errc{} || end != last) at_s = -1.0;
  }
  if (!known || !(at_s >= 0.0 && at_s <= kLatest_s)) {
    return config::without_controls(
        "--ask must be arm, start, pause, resume, stop or reset, and when, from 0 to 10000 s, "
        "as in pause@12.5, not \"" +
        text + "\".");
  }
  command = {at_s, *known};
  return {};
}

}  // namespace polygmap::sim
