// SPDX-License-Identifier: Apache-2.0
// The fakes keep the ports' contracts, and fail when told to.
#include <gtest/gtest.h>

#include <limits>

#include "firmware/operator_answer_text.hpp"
#include "tests/support/fakes/fake_clock.hpp"
#include "tests/support/fakes/fake_depth_camera.hpp"
#include "tests/support/fakes/fake_imu.hpp"
#include "tests/support/fakes/fake_joint_bus.hpp"
#include "tests/support/fakes/fake_lidar_odometry.hpp"
#include "tests/support/fakes/fake_operator_input.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap::contract {
namespace {

using namespace fakes;

struct FakeClockHarness {
  FakeClock clock;
  hal::Clock& port() { return clock; }
  void pass(std::int64_t duration_ns) {
    clock.advance_ns(duration_ns);
    clock.advance_count(UINT64_MAX / 3);  // wraps around in the course of a test
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Fake, ClockContract, FakeClockHarness);

struct FakeImuHarness {
  static constexpr int kFlood = 1000;
  FakeImu imu;
  ImuSample next{.stamp_ns = 0, .gyro_radps = Vec3::Zero(), .accel_mps2 = {0.0, 0.0, kGravity_mps2}};
  hal::Imu& port() { return imu; }
  std::int64_t feed() {
    next.stamp_ns += 2'000'000;
    imu.feed(next);
    return next.stamp_ns;
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Fake, ImuContract, FakeImuHarness);

struct FakeLidarOdometryHarness {
  static constexpr int kFlood = 100;
  FakeLidarOdometry lio;
  LioSample next{.stamp_ns = 0,
                 .lio_T_lidar = {},
                 .position_sigma_m = Vec3::Constant(0.01),
                 .rotation_sigma_rad = Vec3::Constant(0.001)};
  hal::LidarOdometry& port() { return lio; }
  std::int64_t feed() {
    next.stamp_ns += 100'000'000;
    lio.feed(next);
    return next.stamp_ns;
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Fake, LidarOdometryContract, FakeLidarOdometryHarness);

struct FakeJointBusHarness {
  FakeJointBus bus;
  JointFeedback next;
  hal::JointBus& port() { return bus; }
  std::int64_t feed() {
    next.stamp_ns += 2'000'000;
    bus.feed(next);
    return next.stamp_ns;
  }
  bool last_command(JointCommand& command) const {
    if (bus.commands().empty()) return false;
    command = bus.commands().newest();
    return true;
  }
  void refuse_next_write() { bus.writes.fail_next(); }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Fake, JointBusContract, FakeJointBusHarness);

constexpr CameraIntrinsics kSmallCamera{
    .width_px = 8, .height_px = 6, .fx_px = 7.0, .fy_px = 7.0, .cx_px = 3.5, .cy_px = 2.5};

struct FakeDepthCameraHarness {
  static constexpr int kFlood = 10;
  FakeDepthCamera camera{kSmallCamera};
  std::vector<std::uint16_t> picture = std::vector<std::uint16_t>(48, 1000);
  std::int64_t stamp_ns = 0;
  hal::DepthCamera& port() { return camera; }
  std::int64_t feed() {
    ++picture.front();
    ++picture.back();
    camera.feed(stamp_ns += 33'333'333, picture);
    return stamp_ns;
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Fake, DepthCameraContract, FakeDepthCameraHarness);

struct FakeOperatorInputHarness {
  FakeOperatorInput input;
  hal::OperatorInput& port() { return input; }
  void ask(OperatorCommand command) { input.ask(command); }
  std::string told() {
    OperatorAnswer answer;
    EXPECT_TRUE(input.try_take_answer(answer));
    return std::string(text_of(answer, ModuleState::kSafeStop).view());
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Fake, OperatorInputContract, FakeOperatorInputHarness);

TEST(CallScript, Fail_FromTheThirdCallOn_FailsJustThose) {
  CallScript script;
  EXPECT_FALSE(script.next_fails());
  script.fail(2, 2);
  const bool expected[] = {false, false, true, true, false};
  for (const bool fails : expected) EXPECT_EQ(script.next_fails(), fails);
  EXPECT_EQ(script.calls(), 6U);
}

TEST(FakeImu, TryRead_InjectedFailure_KeepsTheSampleForTheNextRead) {
  FakeImuHarness h;
  const std::int64_t stamp_ns = h.feed();
  h.imu.reads.fail_next(2);
  expect_nothing<ImuSample>(h.port());
  expect_nothing<ImuSample>(h.port());
  ImuSample sample;
  ASSERT_TRUE(h.port().try_read(sample));
  EXPECT_EQ(sample.stamp_ns, stamp_ns);
}

TEST(FakeImu, TryRead_BadSampleFed_DeliversItAsItIs) {
  FakeImuHarness h;
  h.next.gyro_radps.x() = std::numeric_limits<double>::quiet_NaN();
  h.feed();
  ImuSample sample;
  ASSERT_TRUE(h.port().try_read(sample));
  EXPECT_FALSE(math::all_finite(sample.gyro_radps));
}

TEST(FakeLidarOdometry, TryRead_InjectedFailure_KeepsThePoseForTheNextRead) {
  FakeLidarOdometryHarness h;
  h.feed();
  h.lio.reads.fail_next();
  expect_nothing<LioSample>(h.port());
  LioSample sample;
  EXPECT_TRUE(h.port().try_read(sample));
}

TEST(FakeJointBus, TryRead_InjectedFailure_KeepsTheFeedbackForTheNextRead) {
  FakeJointBusHarness h;
  h.feed();
  h.bus.reads.fail_next();
  expect_nothing<JointFeedback>(h.port());
  JointFeedback feedback;
  EXPECT_TRUE(h.port().try_read(feedback));
}

TEST(FakeDepthCamera, TryAcquire_InjectedFailure_KeepsTheFrameForTheNextCall) {
  FakeDepthCameraHarness h;
  h.feed();
  h.camera.acquisitions.fail_next();
  DepthFrameView frame;
  EXPECT_FALSE(h.port().try_acquire(frame));
  EXPECT_FALSE(h.camera.holding());
  EXPECT_TRUE(h.port().try_acquire(frame));
  EXPECT_TRUE(h.camera.holding());
}

TEST(FakeDepthCamera, Feed_PictureOfAnotherSize_IsCutOrFilledWithInvalid) {
  FakeDepthCamera camera(kSmallCamera);
  camera.feed(1, std::vector<std::uint16_t>(10, 5));
  DepthFrameView frame;
  ASSERT_TRUE(camera.try_acquire(frame));
  EXPECT_EQ(frame.depth[9], 5);
  EXPECT_EQ(frame.depth[10], 0);
  camera.feed(2, std::vector<std::uint16_t>(100, 6));
  camera.release();
  ASSERT_TRUE(camera.try_acquire(frame));
  EXPECT_EQ(frame.depth[47], 6);
}

TEST(FakeClock, WorkUs_AtItsRate_MovesCyclesAndNotTime) {
  FakeClock clock(2500.0);
  clock.work_us(4.0);
  EXPECT_EQ(clock.count(), 10'000U);
  EXPECT_EQ(clock.now_ns(), 0);
}

}  // namespace
}  // namespace polygmap::contract
