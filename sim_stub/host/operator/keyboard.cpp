// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/operator/keyboard.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ostream>

namespace polygmap::sim {
namespace {

struct Key {
  char key;
  OperatorCommand command;
};
constexpr std::array kKeys{Key{'a', OperatorCommand::kArm},     Key{'s', OperatorCommand::kStart},
                           Key{'p', OperatorCommand::kPause},   Key{'g', OperatorCommand::kResume},
                           Key{'x', OperatorCommand::kStop},    Key{'n', OperatorCommand::kReset},
                           Key{'h', OperatorCommand::kHandOver}};
constexpr const char* kHelp = "a arm, s start, p pause, g go on, x stop, n new start (reset), h hand over, q quit\n";

}  // namespace

Keyboard::Keyboard(std::ostream& out) : ClimbOperator(out) {
  out << kHelp << std::flush;
  termios usual{};
  if (::isatty(STDIN_FILENO) == 0 || ::tcgetattr(STDIN_FILENO, &usual) != 0) return;
  termios single_keys = usual;
  single_keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  if (::tcsetattr(STDIN_FILENO, TCSANOW, &single_keys) == 0) usual_ = usual;
}

Keyboard::~Keyboard() {
  if (usual_) (void)::tcsetattr(STDIN_FILENO, TCSANOW, &*usual_);
}

void Keyboard::read_keys() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (!closed_ && ::poll(&input, 1, 0) > 0) {
    char key = 0;
    const auto got = ::read(STDIN_FILENO, &key, 1);
    closed_ = got <= 0;
    if (closed_ || key == '\n' || key == ' ') continue;
    const auto known = std::ranges::find(kKeys, key, &Key::key);
    quits_ = quits_ || key == 'q';
    if (known != kKeys.end()) {
      asked_.push_back(known->command);
    } else if (key != 'q') {
      out() << kHelp << std::flush;
    }
  }
}

void Keyboard::listen() { read_keys(); }

std::optional<OperatorRequest> Keyboard::next() {
  if (asked_.empty()) return std::nullopt;
  const OperatorCommand command = asked_.front();
  asked_.pop_front();
  return command;
}

}  // namespace polygmap::sim
