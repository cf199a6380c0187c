// SPDX-License-Identifier: Apache-2.0
// What every implementation of a HAL port must do, as one test suite per port. An implementation takes part by a small
// harness and one line:
//
//   struct MyImuHarness {
//     hal::Imu& port();                      // the implementation, nothing arrived yet
//     std::int64_t feed();                   // lets the next valid sample arrive; its stamp
//     static constexpr int kFlood = 1000;    // more samples than the implementation keeps
//   };
//   INSTANTIATE_TYPED_TEST_SUITE_P(Mine, ImuContract, MyImuHarness);   // in namespace polygmap::contract
//
// A harness of a device that this machine may lack says so by const char* absent(): why it is, or null; its tests skip.
// The harnesses of the ports differ only in what is listed above each suite. Each test makes a new harness. A program
// that includes this and leaves out a port fails, unless it says GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(suite).
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/math/math.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "hal/ports/clock.hpp"
#include "hal/ports/depth_camera.hpp"
#include "hal/ports/imu.hpp"
#include "hal/ports/joint_bus.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "hal/ports/operator_input.hpp"
#include "scheduler/cycle_monitor.hpp"

namespace polygmap::contract {

// Nobody destroys an implementation through its port, so no port needs operator delete.
template <typename Port>
inline constexpr bool kIsPort =
    std::is_abstract_v<Port> && !std::is_destructible_v<Port> && !std::has_virtual_destructor_v<Port>;
static_assert(kIsPort<hal::Clock> && kIsPort<hal::DepthCamera> && kIsPort<hal::Imu> && kIsPort<hal::JointBus> &&
              kIsPort<hal::LidarOdometry> && kIsPort<hal::OperatorInput>);

// hal::Clock& port(); void pass(std::int64_t duration_ns): returns when at least that much time has passed.
template <typename Harness>
class ClockContract : public ::testing::Test {
 protected:
  Harness harness;
};
TYPED_TEST_SUITE_P(ClockContract);

TYPED_TEST_P(ClockContract, NowNs_ReadRepeatedly_NeverGoesBack) {
  const hal::Clock& clock = this->harness.port();
  std::int64_t last_ns = clock.now_ns();
  for (int i = 0; i < 10'000; ++i) {
    if (i % 2000 == 0) this->harness.pass(10'000);
    const std::int64_t now_ns = clock.now_ns();
    ASSERT_GE(now_ns, last_ns);
    last_ns = now_ns;
  }
}
TYPED_TEST_P(ClockContract, NowNs_TimePasses_AdvancesByAtLeastThat) {
  const std::int64_t begin_ns = this->harness.port().now_ns();
  this->harness.pass(2'000'000);
  EXPECT_GE(this->harness.port().now_ns() - begin_ns, 2'000'000);
}
TYPED_TEST_P(ClockContract, Count_ReadRepeatedly_NeverGoesBack) {
  const hal::Clock& clock = this->harness.port();
  std::uint64_t last = clock.count();
  for (int i = 0; i < 10'000; ++i) {
    if (i % 2000 == 0) this->harness.pass(10'000);
    const std::uint64_t count = clock.count();
    ASSERT_LT(count - last, std::uint64_t{1} << 63);  // modulo 2^64
    last = count;
  }
}
TYPED_TEST_P(ClockContract, CountsPerUs_AnyTime_IsOneRateInRange) {
  const double rate = this->harness.port().counts_per_us();
  EXPECT_TRUE(CounterScale::valid(rate)) << rate;
  this->harness.pass(1'000'000);
  EXPECT_EQ(this->harness.port().counts_per_us(), rate);
}
REGISTER_TYPED_TEST_SUITE_P(ClockContract, NowNs_ReadRepeatedly_NeverGoesBack, NowNs_TimePasses_AdvancesByAtLeastThat,
                            Count_ReadRepeatedly_NeverGoesBack, CountsPerUs_AnyTime_IsOneRateInRange);

// Ports that deliver a queue of stamped samples: the same contract for the IMU and the lidar odometry.
template <typename Sample, typename Port>
void expect_nothing(Port& port) {
  Sample sample;
  sample.stamp_ns = -77;
  EXPECT_FALSE(port.try_read(sample));
  EXPECT_EQ(sample.stamp_ns, -77) << "a refused read must leave the sample alone";
}
template <typename Sample, typename Harness>
void expect_each_sample_once(Harness& harness) {
  for (int i = 0; i < 5; ++i) {
    const std::int64_t stamp_ns = harness.feed();
    Sample sample;
    ASSERT_TRUE(harness.port().try_read(sample));
    EXPECT_EQ(sample.stamp_ns, stamp_ns);
    expect_nothing<Sample>(harness.port());
  }
}
template <typename Sample, typename Harness>
void expect_oldest_first(Harness& harness) {
  std::vector<std::int64_t> fed;
  for (int i = 0; i < 4; ++i) fed.push_back(harness.feed());
  for (const std::int64_t stamp_ns : fed) {
    Sample sample;
    ASSERT_TRUE(harness.port().try_read(sample));
    EXPECT_EQ(sample.stamp_ns, stamp_ns);
  }
  EXPECT_TRUE(std::is_sorted(fed.begin(), fed.end()));
  EXPECT_EQ(std::adjacent_find(fed.begin(), fed.end()), fed.end()) << "stamps increase strictly";
  expect_nothing<Sample>(harness.port());
}
template <typename Sample, typename Harness>
void expect_newest_survive(Harness& harness) {
  std::int64_t newest_ns = 0;
  for (int i = 0; i < Harness::kFlood; ++i) newest_ns = harness.feed();
  std::int64_t last_ns = INT64_MIN;
  int read = 0;
  Sample sample;
  while (read <= Harness::kFlood && harness.port().try_read(sample)) {
    ASSERT_GT(sample.stamp_ns, last_ns);
    last_ns = sample.stamp_ns;
    ++read;
  }
  EXPECT_GT(read, 0);
  EXPECT_LT(read, Harness::kFlood) << "the flood did not fill the implementation's buffer: raise kFlood";
  EXPECT_EQ(last_ns, newest_ns);
}

// hal::Imu& port(); std::int64_t feed(); static constexpr int kFlood.
template <typename Harness>
class ImuContract : public ::testing::Test {
 protected:
  Harness harness;
};
TYPED_TEST_SUITE_P(ImuContract);

TYPED_TEST_P(ImuContract, TryRead_NothingArrived_IsFalseAndLeavesTheSample) {
  expect_nothing<ImuSample>(this->harness.port());
}
TYPED_TEST_P(ImuContract, TryRead_SamplesOneByOne_GivesEachOnce) { expect_each_sample_once<ImuSample>(this->harness); }
TYPED_TEST_P(ImuContract, TryRead_SeveralWaiting_GivesTheOldestFirst) { expect_oldest_first<ImuSample>(this->harness); }
TYPED_TEST_P(ImuContract, TryRead_NobodyReadForLong_KeepsTheNewest) { expect_newest_survive<ImuSample>(this->harness); }
TYPED_TEST_P(ImuContract, TryRead_ValidSample_IsFinite) {
  this->harness.feed();
  ImuSample sample;
  ASSERT_TRUE(this->harness.port().try_read(sample));
  EXPECT_TRUE(math::all_finite(sample.gyro_radps));
  EXPECT_TRUE(math::all_finite(sample.accel_mps2));
}
REGISTER_TYPED_TEST_SUITE_P(ImuContract, TryRead_NothingArrived_IsFalseAndLeavesTheSample,
                            TryRead_SamplesOneByOne_GivesEachOnce, TryRead_SeveralWaiting_GivesTheOldestFirst,
                            TryRead_NobodyReadForLong_KeepsTheNewest, TryRead_ValidSample_IsFinite);

// hal::LidarOdometry& port(); std::int64_t feed(); static constexpr int kFlood.
template <typename Harness>
class LidarOdometryContract : public ::testing::Test {
 protected:
  Harness harness;
};
TYPED_TEST_SUITE_P(LidarOdometryContract);

TYPED_TEST_P(LidarOdometryContract, TryRead_NothingArrived_IsFalseAndLeavesTheSample) {
  expect_nothing<LioSample>(this->harness.port());
}
TYPED_TEST_P(LidarOdometryContract, TryRead_PosesOneByOne_GivesEachOnce) {
  expect_each_sample_once<LioSample>(this->harness);
}
TYPED_TEST_P(LidarOdometryContract, TryRead_SeveralWaiting_GivesTheOldestFirst) {
  expect_oldest_first<LioSample>(this->harness);
}
TYPED_TEST_P(LidarOdometryContract, TryRead_NobodyReadForLong_KeepsTheNewest) {
  expect_newest_survive<LioSample>(this->harness);
}
TYPED_TEST_P(LidarOdometryContract, TryRead_ValidPose_IsARotationWithPositiveSigmas) {
  this->harness.feed();
  LioSample sample;
  ASSERT_TRUE(this->harness.port().try_read(sample));
  const Mat3& R = sample.lio_T_lidar.R;
  EXPECT_LT((R * R.transpose() - Mat3::Identity()).norm(), 1e-9);
  EXPECT_TRUE(math::all_finite(sample.lio_T_lidar.p_m));
  EXPECT_GT(sample.position_sigma_m.minCoeff(), 0.0);
  EXPECT_GT(sample.rotation_sigma_rad.minCoeff(), 0.0);
}
REGISTER_TYPED_TEST_SUITE_P(LidarOdometryContract, TryRead_NothingArrived_IsFalseAndLeavesTheSample,
                            TryRead_PosesOneByOne_GivesEachOnce, TryRead_SeveralWaiting_GivesTheOldestFirst,
                            TryRead_NobodyReadForLong_KeepsTheNewest, TryRead_ValidPose_IsARotationWithPositiveSigmas);

// hal::JointBus& port(); std::int64_t feed();
// bool last_command(JointCommand&): what reached the drives last, false: nothing yet;
// optional void refuse_next_write().
template <typename Harness>
class JointBusContract : public ::testing::Test {
 protected:
  static JointCommand command(std::int64_t stamp_ns) {
    JointCommand c;
    c.stamp_ns = stamp_ns;
    for (std::size_t j = 0; j < kJointCount; ++j) {
      const double x = 0.001 * static_cast<double>(j + 1);
      c.joints[j] = {.q_rad = x, .dq_radps = 2 * x, .tau_ff_nm = 3 * x, .kp_nmprad = 100.0, .kd_nmsprad = 2.0};
    }
    return c;
  }
  Harness harness;
};
TYPED_TEST_SUITE_P(JointBusContract);

TYPED_TEST_P(JointBusContract, TryRead_NothingArrived_IsFalseAndLeavesTheFeedback) {
  expect_nothing<JointFeedback>(this->harness.port());
}
TYPED_TEST_P(JointBusContract, TryRead_FeedbackOneByOne_GivesEachOnce) {
  expect_each_sample_once<JointFeedback>(this->harness);
}
TYPED_TEST_P(JointBusContract, TryRead_SeveralArrived_GivesTheNewestOnly) {
  std::int64_t newest_ns = 0;
  for (int i = 0; i < 3; ++i) newest_ns = this->harness.feed();
  JointFeedback feedback;
  ASSERT_TRUE(this->harness.port().try_read(feedback));
  EXPECT_EQ(feedback.stamp_ns, newest_ns);
  expect_nothing<JointFeedback>(this->harness.port());
}
TYPED_TEST_P(JointBusContract, TryRead_ValidFeedback_IsFiniteAndFeetDoNotPull) {
  this->harness.feed();
  JointFeedback feedback;
  ASSERT_TRUE(this->harness.port().try_read(feedback));
  EXPECT_TRUE(math::all_finite(feedback.q_rad));
  EXPECT_TRUE(math::all_finite(feedback.dq_radps));
  EXPECT_TRUE(math::all_finite(feedback.tau_nm));
  for (const double force_n : feedback.foot_force_n) EXPECT_GE(force_n, 0.0);
}
TYPED_TEST_P(JointBusContract, TryWrite_Command_ReachesTheDrivesUnchanged) {
  JointCommand arrived;
  EXPECT_FALSE(this->harness.last_command(arrived));
  const JointCommand sent = this->command(1000);
  ASSERT_TRUE(this->harness.port().try_write(sent).is_all());
  ASSERT_TRUE(this->harness.last_command(arrived));
  EXPECT_EQ(arrived.stamp_ns, sent.stamp_ns);
  for (std::size_t j = 0; j < kJointCount; ++j) {
    EXPECT_EQ(arrived.joints[j].q_rad, sent.joints[j].q_rad) << j;
    EXPECT_EQ(arrived.joints[j].dq_radps, sent.joints[j].dq_radps) << j;
    EXPECT_EQ(arrived.joints[j].tau_ff_nm, sent.joints[j].tau_ff_nm) << j;
    EXPECT_EQ(arrived.joints[j].kp_nmprad, sent.joints[j].kp_nmprad) << j;
    EXPECT_EQ(arrived.joints[j].kd_nmsprad, sent.joints[j].kd_nmsprad) << j;
  }
}
TYPED_TEST_P(JointBusContract, TryWrite_BusRefuses_SaysSoAndSendsNothing) {
  if constexpr (requires { this->harness.refuse_next_write(); }) {
    ASSERT_TRUE(this->harness.port().try_write(this->command(1000)).is_all());
    this->harness.refuse_next_write();
    EXPECT_TRUE(this->harness.port().try_write(this->command(2000)).is_empty());
    JointCommand arrived;
    ASSERT_TRUE(this->harness.last_command(arrived));
    EXPECT_EQ(arrived.stamp_ns, 1000);
    EXPECT_TRUE(this->harness.port().try_write(this->command(3000)).is_all());
  } else {
    GTEST_SKIP() << "this bus never refuses";
  }
}
REGISTER_TYPED_TEST_SUITE_P(JointBusContract, TryRead_NothingArrived_IsFalseAndLeavesTheFeedback,
                            TryRead_FeedbackOneByOne_GivesEachOnce, TryRead_SeveralArrived_GivesTheNewestOnly,
                            TryRead_ValidFeedback_IsFiniteAndFeetDoNotPull, TryWrite_Command_ReachesTheDrivesUnchanged,
                            TryWrite_BusRefuses_SaysSoAndSendsNothing);

// hal::DepthCamera& port(); std::int64_t feed(): the next frame arrives, different from the one before; its stamp;
// static constexpr int kFlood.
template <typename Harness>
class DepthCameraContract : public ::testing::Test {
 protected:
  static std::vector<std::uint16_t> pixels_of(const DepthFrameView& frame) {
    return {frame.depth, frame.depth + std::ptrdiff_t{frame.width_px} * frame.height_px};
  }
  void SetUp() override {
    if constexpr (requires { harness.absent(); }) {
      if (const char* why = harness.absent()) GTEST_SKIP() << why;
    }
  }
  Harness harness;
};
TYPED_TEST_SUITE_P(DepthCameraContract);

TYPED_TEST_P(DepthCameraContract, Intrinsics_AnyTime_ArePlausibleAndFixed) {
  const CameraIntrinsics a = this->harness.port().intrinsics();
  EXPECT_GT(a.width_px, 0);
  EXPECT_LE(a.width_px, kDepthWidth_px);
  EXPECT_GT(a.height_px, 0);
  EXPECT_LE(a.height_px, kDepthHeight_px);
  EXPECT_GT(a.fx_px, 0.0);
  EXPECT_GT(a.fy_px, 0.0);
  EXPECT_GT(a.cx_px, 0.0);
  EXPECT_LT(a.cx_px, a.width_px);
  EXPECT_GT(a.cy_px, 0.0);
  EXPECT_LT(a.cy_px, a.height_px);
  EXPECT_GT(a.depth_unit_m, 0.0);
  this->harness.feed();
  const CameraIntrinsics b = this->harness.port().intrinsics();
  EXPECT_EQ(a.fx_px, b.fx_px);
  EXPECT_EQ(a.fy_px, b.fy_px);
  EXPECT_EQ(a.cx_px, b.cx_px);
  EXPECT_EQ(a.cy_px, b.cy_px);
  EXPECT_EQ(a.width_px, b.width_px);
  EXPECT_EQ(a.height_px, b.height_px);
  EXPECT_EQ(a.depth_unit_m, b.depth_unit_m);
}
TYPED_TEST_P(DepthCameraContract, TryAcquire_NothingArrived_IsFalseAndLeavesTheFrame) {
  DepthFrameView frame;
  frame.stamp_ns = -77;
  EXPECT_FALSE(this->harness.port().try_acquire(frame));
  EXPECT_EQ(frame.stamp_ns, -77);
  this->harness.port().release();  // nothing held: without effect
  EXPECT_FALSE(this->harness.port().try_acquire(frame));
}
TYPED_TEST_P(DepthCameraContract, TryAcquire_FrameArrived_HasTheIntrinsicsSizeAndPixels) {
  const std::int64_t stamp_ns = this->harness.feed();
  DepthFrameView frame;
  ASSERT_TRUE(this->harness.port().try_acquire(frame));
  EXPECT_EQ(frame.stamp_ns, stamp_ns);
  EXPECT_EQ(frame.width_px, this->harness.port().intrinsics().width_px);
  EXPECT_EQ(frame.height_px, this->harness.port().intrinsics().height_px);
  EXPECT_NE(frame.depth, nullptr);
}
TYPED_TEST_P(DepthCameraContract, TryAcquire_OneHeld_IsFalseUntilReleased) {
  this->harness.feed();
  DepthFrameView first, second;
  ASSERT_TRUE(this->harness.port().try_acquire(first));
  const std::int64_t next_ns = this->harness.feed();
  EXPECT_FALSE(this->harness.port().try_acquire(second));
  this->harness.port().release();
  ASSERT_TRUE(this->harness.port().try_acquire(second));
  EXPECT_EQ(second.stamp_ns, next_ns);
  EXPECT_EQ(second.sequence, first.sequence + 1);
  this->harness.port().release();
  EXPECT_FALSE(this->harness.port().try_acquire(first)) << "each frame is given once";
}
TYPED_TEST_P(DepthCameraContract, TryAcquire_HeldWhileManyArrive_KeepsItsPixelsAndThenGivesTheNewestLast) {
  this->harness.feed();
  DepthFrameView held;
  ASSERT_TRUE(this->harness.port().try_acquire(held));
  const std::vector<std::uint16_t> before = TestFixture::pixels_of(held);
  std::int64_t newest_ns = 0;
  for (int i = 0; i < TypeParam::kFlood; ++i) newest_ns = this->harness.feed();
  EXPECT_EQ(TestFixture::pixels_of(held), before);
  this->harness.port().release();
  DepthFrameView last = held;
  std::vector<std::uint16_t> last_pixels = before;
  int acquired = 0;
  DepthFrameView frame;
  while (acquired <= TypeParam::kFlood && this->harness.port().try_acquire(frame)) {
    ASSERT_GT(frame.stamp_ns, last.stamp_ns);
    ASSERT_GT(frame.sequence, last.sequence);
    const std::vector<std::uint16_t> pixels = TestFixture::pixels_of(frame);
    EXPECT_NE(pixels, last_pixels) << "a frame of its own has pixels of its own";
    last = frame;
    last_pixels = pixels;
    ++acquired;
    this->harness.port().release();
  }
  EXPECT_GT(acquired, 0);
  EXPECT_LT(acquired, TypeParam::kFlood) << "the flood did not fill the implementation's buffers: raise kFlood";
  EXPECT_EQ(last.stamp_ns, newest_ns);
}
REGISTER_TYPED_TEST_SUITE_P(DepthCameraContract, Intrinsics_AnyTime_ArePlausibleAndFixed,
                            TryAcquire_NothingArrived_IsFalseAndLeavesTheFrame,
                            TryAcquire_FrameArrived_HasTheIntrinsicsSizeAndPixels,
                            TryAcquire_OneHeld_IsFalseUntilReleased,
                            TryAcquire_HeldWhileManyArrive_KeepsItsPixelsAndThenGivesTheNewestLast);

// hal::OperatorInput& port(): whatever is on its way has arrived; void ask(OperatorCommand);
// std::string told(): what whoever asked last has been told since.
template <typename Harness>
class OperatorInputContract : public ::testing::Test {
 protected:
  // Nothing where there is no command.
  [[nodiscard]] std::optional<OperatorCommand> read() {
    OperatorRequest request = OperatorCommand::kPause;
    if (this->harness.port().try_read(request)) return request.command;
    EXPECT_EQ(request.command, OperatorCommand::kPause) << "a refused read must leave the request alone";
    return std::nullopt;
  }
  Harness harness;
};
TYPED_TEST_SUITE_P(OperatorInputContract);

TYPED_TEST_P(OperatorInputContract, TryRead_NothingAsked_IsFalseAndLeavesTheCommand) {
  EXPECT_EQ(this->read(), std::nullopt);
}
TYPED_TEST_P(OperatorInputContract, TryRead_CommandsOneByOne_GivesEachOnce) {
  for (const auto command : {OperatorCommand::kArm, OperatorCommand::kStart, OperatorCommand::kReset}) {
    this->harness.ask(command);
    EXPECT_EQ(this->read(), command);
    this->harness.port().answer({});
    EXPECT_EQ(this->read(), std::nullopt);
  }
}
TYPED_TEST_P(OperatorInputContract, TryRead_SeveralAsked_GivesTheOldestFirst) {
  constexpr std::array kAsked{OperatorCommand::kArm, OperatorCommand::kStop, OperatorCommand::kArm};
  for (const auto command : kAsked) this->harness.ask(command);
  for (const auto command : kAsked) {
    EXPECT_EQ(this->read(), command);
    this->harness.port().answer({});
  }
  EXPECT_EQ(this->read(), std::nullopt);
}
TYPED_TEST_P(OperatorInputContract, Answer_Refused_IsToldWithItsReason) {
  this->harness.ask(OperatorCommand::kReset);
  ASSERT_EQ(this->read(), OperatorCommand::kReset);
  this->harness.port().answer({Refusal::kDrivesSilent, JointSet::of_bits(1U << kKnee)});
  const std::string told = this->harness.told();
  EXPECT_NE(told.find("refused: "), std::string::npos) << told;
  EXPECT_NE(told.find(", no answer yet from left_knee"), std::string::npos) << told;
}
TYPED_TEST_P(OperatorInputContract, Answer_Obeyed_IsToldAsNoRefusal) {
  this->harness.ask(OperatorCommand::kArm);
  ASSERT_EQ(this->read(), OperatorCommand::kArm);
  this->harness.port().answer({});
  const std::string told = this->harness.told();
  EXPECT_EQ(told.find("refused"), std::string::npos) << told;
}
REGISTER_TYPED_TEST_SUITE_P(OperatorInputContract, TryRead_NothingAsked_IsFalseAndLeavesTheCommand,
                            TryRead_CommandsOneByOne_GivesEachOnce, TryRead_SeveralAsked_GivesTheOldestFirst,
                            Answer_Refused_IsToldWithItsReason, Answer_Obeyed_IsToldAsNoRefusal);

}  // namespace polygmap::contract
