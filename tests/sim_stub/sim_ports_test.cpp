// SPDX-License-Identifier: Apache-2.0
// The simulated robot and its scripted operator keep the ports' contracts, all six of them.
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "sim_stub/host/operator/climb_operator.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap::contract {
namespace {

using sim::SimDepthCamera;
using sim::SimOptions;
using sim::SimRobot;
using sim::VirtualClock;

SimOptions without_pictures() {
  SimOptions options;
  options.camera.silent = {{0, std::numeric_limits<std::int64_t>::max()}};
  return options;
}

// A robot stands and senses from the start: what it sampled before the test began is read away.
struct BlindRobot {
  SimRobot robot{without_pictures()};
  BlindRobot() {
    ImuSample imu;
    JointFeedback joints;
    EXPECT_TRUE(robot.try_read(imu));
    EXPECT_TRUE(robot.try_read(joints));
  }
  std::int64_t advance(std::int64_t ticks) {
    for (std::int64_t i = 0; i < ticks; ++i) robot.advance();
    return robot.now_ns();
  }
};

struct SimClockHarness : BlindRobot {
  hal::Clock& port() { return robot; }
  void pass(std::int64_t duration_ns) {
    advance((duration_ns + VirtualClock::kTick_ns - 1) / VirtualClock::kTick_ns);
    robot.clock().inject_count(std::numeric_limits<std::uint64_t>::max() / 3);  // wraps around in a test
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Sim, ClockContract, SimClockHarness);

struct SimImuHarness : BlindRobot {
  static constexpr int kFlood = 200;
  hal::Imu& port() { return robot; }
  std::int64_t feed() { return advance(1); }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Sim, ImuContract, SimImuHarness);

struct SimJointBusHarness : BlindRobot {
  hal::JointBus& port() { return robot; }
  std::int64_t feed() { return advance(1); }
  bool last_command(JointCommand& command) const {
    if (robot.last_command()) command = *robot.last_command();
    return robot.last_command().has_value();
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Sim, JointBusContract, SimJointBusHarness);

struct SimLidarOdometryHarness : BlindRobot {
  static constexpr int kFlood = 40;
  static constexpr std::int64_t kPeriod_ticks = 50;  // 10 Hz, and as late as that
  hal::LidarOdometry& port() { return robot; }
  std::int64_t feed() { return advance(kPeriod_ticks) - kPeriod_ticks * VirtualClock::kTick_ns; }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Sim, LidarOdometryContract, SimLidarOdometryHarness);

struct SimDepthCameraHarness {
  static constexpr int kFlood = 8;
  SimRobot robot{SimOptions{}};
  std::int64_t frame = 0;
  hal::DepthCamera& port() { return robot; }
  std::int64_t feed() {
    const std::int64_t exposure_tick = SimDepthCamera::exposure_tick(frame++);
    while (robot.clock().tick() < exposure_tick + SimDepthCamera::kLatency_ticks) robot.advance();
    return VirtualClock::stamp_ns(exposure_tick);
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Sim, DepthCameraContract, SimDepthCameraHarness);

struct ScriptedOperatorHarness {
  std::ostringstream out;
  std::vector<sim::TimedRequest> script;
  std::optional<sim::ScriptedOperator> scripted;
  // Of what was asked until the first look; asking begins anew.
  hal::OperatorInput& port() {
    if (!scripted) scripted.emplace(std::exchange(script, {}), out);
    scripted->look(kNsPerS, ModuleState::kSafeStop);
    return *scripted;
  }
  void ask(OperatorCommand command) {
    script.push_back({0.5, command});
    scripted.reset();
  }
  std::string told() const { return out.str(); }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Scripted, OperatorInputContract, ScriptedOperatorHarness);

}  // namespace
}  // namespace polygmap::contract
