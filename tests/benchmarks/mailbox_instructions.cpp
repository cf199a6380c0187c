// SPDX-License-Identifier: Apache-2.0
// What the mailbox adds to a cycle of control, over seconds in which the robot walks up to stairs that it maps: what
// toolchain/checks/instructions counts. Prints the build that the counts are of, and over how many cycles they are.
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <string>

#include "firmware/mailbox/mailbox_feed.hpp"
#include "firmware/schedule.hpp"
#include "tests/benchmarks/build_name.hpp"
#include "tests/support/fake_robot.hpp"

namespace polygmap::bench {
namespace {

constexpr int kCycles = 3000, kPicture_ticks = 80;

// Pose and status of a cycle; every 50th of them also what was counted.
[[gnu::noinline]] bool stage_mailbox(MailboxFeed& feed, const ControlLane& control, const Telemetry& telemetry) {
  return feed.write_state(control, telemetry);
}
// In a cycle that writes it.
[[gnu::noinline]] void stage_mailbox_plan(MailboxFeed& feed, const ControlLane& control, const Telemetry& telemetry) {
  feed.write_plan(control, telemetry);
}

int run() {
  test::FakeRobot robot(0.062);
  robot.picture_ticks = kPicture_ticks;
  const auto module = std::make_unique<Pipeline>(robot.ports(), Params{});
  const auto watched = std::make_unique<PerceptionTelemetry>();
  module->watch(*watched);
  OneLaneExecutive<> executive(*module, robot.clock, module->lane_health(0));
  MailboxWriter mailbox;
  if (const std::string wrong = mailbox.open({.name = "/polygmap_bench_" + std::to_string(::getpid()), .group = {}});
      !wrong.empty()) {
    std::fprintf(stderr, "mailbox_instructions: %s\n", wrong.c_str());
    return 1;
  }
  const auto feed = std::make_unique<MailboxFeed>(mailbox);
  executive.start(robot.clock.now_ns() + kCycle_ns);
  int plans = 0;
  for (int i = 0; i < kCycles; ++i) {
    robot.advance();
    executive.tick(robot.clock.now_ns());
    const Telemetry telemetry = module->telemetry(robot.clock.now_ns(), *watched);
    (void)stage_mailbox(*feed, module->control(), telemetry);
    if (!feed->plan_is_due(telemetry)) continue;
    ++plans;
    stage_mailbox_plan(*feed, module->control(), telemetry);
  }
  if (module->control().gait_status().step.sequence < 2 || watched->map.front().polygons.empty()) {
    std::fprintf(stderr, "mailbox_instructions: there was nothing to plan.\n");
    return 1;
  }
  std::printf("build %s\nruns %d\nruns_of mailbox_plan %d\n", build_name().c_str(), kCycles, plans);
  return 0;
}

}  // namespace
}  // namespace polygmap::bench

int main() { return polygmap::bench::run(); }
