// SPDX-License-Identifier: Apache-2.0
// The ports that a caller pushes into keep the ports' contracts, all six of them, and the clock lays its time on the
// module's.
#include "firmware/link/pushed_ports.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "firmware/operator_answer_text.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap::contract {
namespace {

using namespace link;

// The caller's clock: its zero is not the module's.
constexpr std::int64_t kBegin_ns = -7 * kNsPerS;

struct RunningClock {
  InstanceClock clock;
  std::int64_t caller_ns = kBegin_ns;
  RunningClock() { pass(1); }
  void pass(std::int64_t duration_ns) {
    caller_ns += duration_ns;
    EXPECT_TRUE(clock.try_advance(caller_ns));
  }
};

struct PushedClockHarness : RunningClock {
  hal::Clock& port() { return clock; }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Pushed, ClockContract, PushedClockHarness);

template <class Port, class Sample>
struct PushedHarness : RunningClock {
  static constexpr int kFlood = 200;
  Port pushed{clock};
  Sample next;
  auto& port() { return pushed; }
  std::int64_t feed() {
    pass(kNsPerMs);
    next.stamp_ns = caller_ns;
    EXPECT_TRUE(pushed.queue.try_push(next));
    return clock.now_ns();
  }
};
struct PushedImuHarness : PushedHarness<PushedImu, ImuSample> {};
INSTANTIATE_TYPED_TEST_SUITE_P(Pushed, ImuContract, PushedImuHarness);
struct PushedLioHarness : PushedHarness<PushedLio, LioSample> {
  PushedLioHarness() { next.position_sigma_m = next.rotation_sigma_rad = Vec3::Constant(0.01); }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Pushed, LidarOdometryContract, PushedLioHarness);

struct PushedJointsHarness : RunningClock {
  PushedJoints pushed{clock};
  hal::JointBus& port() { return pushed; }
  std::int64_t feed() {
    pass(kNsPerMs);
    JointFeedback next;
    next.stamp_ns = caller_ns;
    EXPECT_TRUE(pushed.try_push(next, {}));
    return clock.now_ns();
  }
  bool last_command(JointCommand& command) const {
    if (pushed.command() == nullptr) return false;
    command = *pushed.command();
    return true;
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Pushed, JointBusContract, PushedJointsHarness);

struct PushedDepthHarness : RunningClock {
  static constexpr int kFlood = 5;
  static constexpr CameraIntrinsics kCamera{
      .width_px = 8, .height_px = 6, .fx_px = 7.0, .fy_px = 7.0, .cx_px = 3.5, .cy_px = 2.5};
  std::unique_ptr<PushedDepth> pushed = std::make_unique<PushedDepth>(clock);
  std::vector<std::uint16_t> pixels = std::vector<std::uint16_t>(48, 1000);
  std::uint32_t sequence = 0;
  PushedDepthHarness() { pushed->set_intrinsics(kCamera); }
  hal::DepthCamera& port() { return *pushed; }
  std::int64_t feed() {
    pass(kNsPerMs);
    ++pixels[sequence % pixels.size()];
    EXPECT_TRUE(pushed->try_push({caller_ns, ++sequence, 8, 6, pixels.data()}));
    return clock.now_ns();
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Pushed, DepthCameraContract, PushedDepthHarness);

struct PushedOperatorHarness {
  PushedOperator pushed;
  hal::OperatorInput& port() { return pushed; }
  void ask(OperatorCommand command) { EXPECT_TRUE(pushed.try_push(command)); }
  std::string told() const { return std::string(text_of(pushed.answered().answer, ModuleState::kSafeStop).view()); }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Pushed, OperatorInputContract, PushedOperatorHarness);

ImuSample imu_at(std::int64_t stamp_ns) { return {stamp_ns, Vec3::Zero(), Vec3::Ones()}; }

TEST(PushedPorts, AStampThatIsNotLater_IsRefusedAndChangesNothing) {
  RunningClock time;
  PushedImu imu(time.clock);
  ImuSample sample = imu_at(time.caller_ns);
  EXPECT_TRUE(imu.queue.try_push(sample));
  sample.accel_mps2.setZero();
  EXPECT_FALSE(imu.queue.try_push(sample));
  --sample.stamp_ns;
  EXPECT_FALSE(imu.queue.try_push(sample));
  ASSERT_TRUE(imu.try_read(sample));
  EXPECT_EQ(sample.accel_mps2, Vec3::Ones());
  EXPECT_FALSE(imu.try_read(sample));
}

// One corrupt stamp of the future does not shut out all that come after it.
TEST(PushedPorts, AStampFarAhead_IsRefusedAndTheNextIsTaken) {
  RunningClock time;
  PushedImu imu(time.clock);
  EXPECT_FALSE(imu.queue.try_push(imu_at(std::numeric_limits<std::int64_t>::max())));
  EXPECT_FALSE(imu.queue.try_push(imu_at(time.caller_ns + kNsPerS + 1)));
  EXPECT_TRUE(imu.queue.try_push(imu_at(time.caller_ns + kNsPerS)));
}

// Before the first step nobody knows the time.
TEST(PushedPorts, PushedBeforeTheFirstStepByAnotherClock_IsForgottenThen) {
  InstanceClock clock;
  PushedImu imu(clock);
  EXPECT_TRUE(imu.queue.try_push(imu_at(500 * kNsPerS)));
  ASSERT_TRUE(clock.try_advance(0));
  imu.queue.begin();
  EXPECT_EQ(imu.queue.dropped(), 1U);
  EXPECT_TRUE(imu.queue.try_push(imu_at(0)));
  ImuSample sample;
  ASSERT_TRUE(imu.try_read(sample));
  EXPECT_EQ(sample.stamp_ns, clock.now_ns());
}

TEST(PushedPorts, Full_PushesOutTheOldestAndCounts) {
  RunningClock time;
  PushedLio lio(time.clock);
  for (int i = 0; i < 18; ++i) {
    time.pass(kNsPerMs);
    LioSample pose;
    pose.stamp_ns = time.caller_ns;
    EXPECT_TRUE(lio.queue.try_push(pose));
  }
  EXPECT_EQ(lio.queue.dropped(), 2U);
}

TEST(PushedPorts, DrivesThatRefusedACommand_RefuseTheNext) {
  RunningClock time;
  PushedJoints joints(time.clock);
  JointFeedback feedback;
  feedback.stamp_ns = time.caller_ns;
  PushedJoints::Drives drives;
  drives.refused.insert(3);
  drives.errors.insert(5);
  drives.degc[2] = 71;
  ASSERT_TRUE(joints.try_push(feedback, drives));
  ASSERT_TRUE(joints.try_read(feedback));
  EXPECT_EQ(joints.status().drive_errors.bits(), 1U << 5);
  EXPECT_EQ(joints.status().drive_error_replies, 1U);
  EXPECT_EQ(joints.status().drive_degc[2], 71);
  JointCommand command;
  command.stamp_ns = 1;
  EXPECT_EQ(joints.try_write(command).bits(), JointSet::all().bits() & ~(1U << 3));
  EXPECT_TRUE(joints.try_write(command).is_all());
}

TEST(InstanceClock, AnyZero_IsTheModulesOwnTime) {
  for (const std::int64_t first_ns : {std::int64_t{0}, std::int64_t{-5}, std::int64_t{1'764'000'000} * kNsPerS,
                                      std::numeric_limits<std::int64_t>::min()}) {
    InstanceClock clock;
    ASSERT_TRUE(clock.try_advance(first_ns));
    EXPECT_GT(clock.now_ns(), 0);
    EXPECT_EQ(clock.to_caller(clock.now_ns()), first_ns);
    EXPECT_EQ(clock.to_module(first_ns + 5) - clock.now_ns(), 5);
    EXPECT_GT(clock.to_module(std::numeric_limits<std::int64_t>::min()), 0);
    EXPECT_FALSE(clock.try_advance(first_ns));
    EXPECT_TRUE(clock.try_advance(first_ns + 1));
    EXPECT_FALSE(clock.try_advance(std::numeric_limits<std::int64_t>::max()));
    EXPECT_EQ(clock.to_caller(clock.now_ns()), first_ns + 1);
  }
}

}  // namespace
}  // namespace polygmap::contract
