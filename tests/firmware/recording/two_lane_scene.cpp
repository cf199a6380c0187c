// SPDX-License-Identifier: Apache-2.0
// two_lane_scene RUN.mcap: the scene of toolchain/scenes that no climb has. A fake robot's module in two lanes, of
// which perception is now and then two frames late; frame by frame, so that it is the same every time.
#include <cstdio>

#include "tests/firmware/recording/recorded_run.hpp"

int main(int argc, char** argv) {
  using namespace polygmap;
  using namespace polygmap::recording;
  if (argc != 2) {
    std::fputs("usage: two_lane_scene RUN.mcap\n", stderr);
    return 2;
  }
  constexpr int kFrames = 2500;
  RecordedModule run(argv[1]);
  LanePair<RecordedTasks<Pipeline>> lanes(run, run.tasks);
  for (int i = 0; i < kFrames; ++i) {
    run.robot.advance();
    lanes.control.tick(run.robot.clock.now_ns());
    if (i % 50 < 48) lanes.perception.tick(run.robot.clock.now_ns());  // the 49th and 50th are run with the next
    run.flush();
  }
  const std::string failure = run.recorder->finish();
  std::fputs(failure.c_str(), stderr);
  return failure.empty() ? 0 : 1;
}
