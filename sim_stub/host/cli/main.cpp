// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <iostream>
#include <string>
#include <vector>

#include "sim_stub/host/cli/climb_command.hpp"

namespace {

std::atomic<int> interrupt_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "set by a signal handler");

void interrupt(int received) {
  interrupt_signal = received;
  for (const int other : {SIGINT, SIGTERM}) std::signal(other, SIG_DFL);
}

// The first SIGINT or SIGTERM is waited for by the command, which leaves whole files or none; the second one kills.
void listen() {
  struct sigaction action {};
  action.sa_handler = interrupt;
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
}

// The climb ends with its files written.
polygmap::sim::ClimbSummary run_until_interrupted(polygmap::sim::ClimbOptions options,
                                                  const polygmap::sim::ClimbProgressFunction& progress) {
  listen();
  options.interrupt = &interrupt_signal;
  return polygmap::sim::run_climb(options, progress);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
  if (!arguments.empty() && (arguments[0] == "perceive" || arguments[0] == "estimate")) listen();
  return polygmap::sim::polygmap_main(arguments, run_until_interrupted, std::cout, std::cerr,
                                      isatty(STDOUT_FILENO) != 0, &interrupt_signal);
}
