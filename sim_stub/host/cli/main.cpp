// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <iostream>
#include <string>
#include <vector>

#include "sim_stub/host/cli/climb_command.hpp"

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
  return polygmap::sim::polygmap_main(arguments, polygmap::sim::run_climb, std::cout, std::cerr,
                                      isatty(STDOUT_FILENO) != 0);
}
