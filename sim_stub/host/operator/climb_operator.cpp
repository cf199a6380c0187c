// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/operator/climb_operator.hpp"

#include <array>
#include <charconv>
#include <cstdio>
#include <ostream>

#include "firmware/config/file_error.hpp"
#include "firmware/config/operator_request_text.hpp"
#include "firmware/operator_answer_text.hpp"
#include "sim_stub/heap_trap.hpp"

namespace polygmap::sim {

void ClimbOperator::say(const std::string& words) {
  std::array<char, 32> time{};
  std::snprintf(time.data(), time.size(), "%8.2f s  ", 1e-9 * static_cast<double>(now_ns_));
  out_ << time.data() << words << "\n" << std::flush;
}

void ClimbOperator::look(std::int64_t now_ns, ModuleState state) {
  now_ns_ = now_ns;
  if (state != state_) say(std::string(name_of(state)));
  state_ = state;
  listen();
}

bool ClimbOperator::try_read(OperatorRequest& request) noexcept {
  const heap::HostCall host;  // of the module's cycle
  const std::optional<OperatorRequest> asked = next();
  if (!asked) return false;
  request = *asked;
  asked_ = asked->command;
  return true;
}

void ClimbOperator::answer(const OperatorAnswer& answer) noexcept {
  const heap::HostCall host;
  if (answer.is_obeyed() || !state_) return;  // the state that comes of it is said by look()
  say(std::string(name_of(asked_)) + " " + std::string(text_of(answer, *state_).view()));
}

std::optional<OperatorRequest> Dispatcher::next() {
  if (state() == ModuleState::kOff && !armed_) {
    armed_ = true;
    return OperatorRequest(OperatorCommand::kArm);
  }
  if (state() == ModuleState::kStanding && !sent_) {
    sent_ = true;
    return OperatorRequest(to_);
  }
  if (state() != ModuleState::kOnTop || !way_back_) return std::nullopt;
  return OperatorRequest(std::exchange(way_back_, nullptr)());
}

std::string read_request(const std::string& text, TimedRequest& request) {
  constexpr double kLatest_s = 10000.0;
  const std::size_t at = text.find('@');
  const auto known = operator_request_of(std::string_view(text).substr(0, at));
  double at_s = -1.0;
  if (at != std::string::npos) {
    const char *first = text.data() + at + 1, *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(first, last, at_s);
    if (error != std::errc{} || end != last) at_s = -1.0;
  }
  if (!known || !(at_s >= 0.0 && at_s <= kLatest_s)) {
    return config::without_controls("--ask must be one of " + std::string(kWhatMayBeAsked) +
                                    ", and when, from 0 to 10000 s, as in pause@12.5, not \"" + text + "\".");
  }
  request = {at_s, *known};
  return {};
}

}  // namespace polygmap::sim
