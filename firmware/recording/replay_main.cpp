// SPDX-License-Identifier: Apache-2.0
// polygmap_replay RUN.mcap: the replay alone, for machines without the host tool.
#include <cstdio>

#include "firmware/recording/replay.hpp"

int main(int argc, char** argv) {
  using namespace polygmap::recording;
  if (argc != 2) {
    std::fputs("usage: polygmap_replay RUN.mcap (written by polygmap climb --record DIR)\n", stderr);
    return static_cast<int>(ReplayVerdict::kUnreadable);
  }
  const ReplayResult result = replay(argv[1]);
  std::fputs(text_of(result).c_str(), result.verdict == ReplayVerdict::kUnreadable ? stderr : stdout);
  return static_cast<int>(result.verdict);
}
