// SPDX-License-Identifier: Apache-2.0
// On a device made up behind the system calls. What runs on the kernel's virtual camera is in v4l2_vivid_test.cpp.
#include "hal/linux/v4l2_camera.hpp"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "sim_stub/heap_trap.hpp"
#include "tests/hal/linux/fake_v4l2.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace {

constexpr CameraIntrinsics kCamera{
    .width_px = 64, .height_px = 48, .fx_px = 50.0, .fy_px = 50.0, .cx_px = 31.5, .cy_px = 23.5};

struct Fixture {
  test::FakeV4l2 device;
  test::ScriptedCalls calls{test::FakeV4l2::calls()};
  hal::V4l2Camera camera{calls.table()};
  std::int64_t stamp_ns = test::monotonic_now_ns() / 1000 * 1000;  // V4L2 has microseconds
  std::uint16_t value = 100;

  Fixture() { open({.device = "/dev/video7", .intrinsics = kCamera}); }
  void open(const hal::V4l2Camera::Config& config) {
    const hal::DeviceError error = camera.open(config);
    EXPECT_FALSE(error.failed()) << error.sentence();
  }
  hal::DepthCamera& port() { return camera; }
  bool picture() { return device.picture(++value, stamp_ns += 33'333'000); }
  std::int64_t feed() {
    EXPECT_TRUE(picture());
    camera.poll();
    return stamp_ns;
  }
  bool acquire(DepthFrameView& frame) {
    const heap::ModuleCall trap("V4l2Camera::try_acquire");
    return camera.try_acquire(frame);
  }
};

}  // namespace

namespace contract {
struct FakeV4l2Harness : Fixture {
  static constexpr int kFlood = 10;
};
INSTANTIATE_TYPED_TEST_SUITE_P(V4l2MadeUp, DepthCameraContract, FakeV4l2Harness);
}  // namespace contract

namespace {

TEST(V4l2Camera, TryAcquire_Picture_StampIsTheMiddleOfTheExposure) {
  Fixture f;
  hal::V4l2Camera::Config config{.device = "/dev/video7",
                                 .intrinsics = kCamera,
                                 .frames_per_s = 30,
                                 .latency_ns = 5'000'000,
                                 .exposure_ns = 16'000'000};
  f.open(config);
  EXPECT_EQ(f.device.frames_per_s, 30U);
  DepthFrameView frame;
  ASSERT_TRUE(f.picture());
  ASSERT_TRUE(f.acquire(frame));
  EXPECT_EQ(frame.stamp_ns, f.stamp_ns / 1000 * 1000 - 13'000'000);
  EXPECT_EQ(frame.depth[64 * 48 - 1], f.value);
  f.camera.release();
  f.device.buffer_flags = V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  ASSERT_TRUE(f.picture());
  ASSERT_TRUE(f.acquire(frame));
  EXPECT_EQ(frame.stamp_ns, f.stamp_ns / 1000 * 1000 + 3'000'000);
}

TEST(V4l2Camera, TryAcquire_FaultyPictures_AreCountedByNameAndTheirBuffersGoBack) {
  Fixture f;
  DepthFrameView frame;
  f.feed();
  ASSERT_TRUE(f.acquire(frame));
  f.camera.release();
  f.device.buffer_flags = V4L2_BUF_FLAG_ERROR;
  ASSERT_TRUE(f.picture());
  EXPECT_FALSE(f.acquire(frame));
  f.device.buffer_flags = 0;
  f.device.missing_bytes = 2;
  ASSERT_TRUE(f.picture());
  EXPECT_FALSE(f.acquire(frame));
  f.device.missing_bytes = 0;
  ASSERT_TRUE(f.device.picture(1, f.stamp_ns - 500'000'000));
  EXPECT_FALSE(f.acquire(frame));
  f.device.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
  ASSERT_TRUE(f.picture());
  EXPECT_FALSE(f.acquire(frame));
  f.device.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  EXPECT_EQ(f.camera.counters().flagged, 1U);
  EXPECT_EQ(f.camera.counters().short_ones, 1U);
  EXPECT_EQ(f.camera.counters().wrong_stamp, 2U);
  EXPECT_EQ(f.device.empty_buffers(), 8U);
  f.feed();
  EXPECT_TRUE(f.acquire(frame));
  EXPECT_EQ(frame.sequence, 6U) << "the kernel numbers faulty pictures, too";
}

TEST(V4l2Camera, TryAcquire_KernelDroppedPictures_GapInTheSequenceIsCounted) {
  Fixture f;
  DepthFrameView first, second;
  f.feed();
  ASSERT_TRUE(f.acquire(first));
  f.camera.release();
  int dropped = 0;
  for (int i = 0; i < 12; ++i) dropped += f.picture() ? 0 : 1;  // nobody polls
  EXPECT_EQ(dropped, 4);
  while (f.acquire(second)) f.camera.release();
  f.feed();
  ASSERT_TRUE(f.acquire(second));
  EXPECT_EQ(second.sequence, first.sequence + 13);
  EXPECT_EQ(f.camera.counters().missing, 4U);
}

TEST(V4l2Camera, TryShare_SecondHolder_BufferGoesBackAfterBoth) {
  Fixture f;
  DepthFrameView frame;
  f.feed();
  EXPECT_FALSE(f.camera.try_share());
  std::vector<DepthFrameView> theirs;
  for (int i = 0; i < 4; ++i) {
    if (i > 0) f.feed();
    ASSERT_TRUE(f.acquire(frame));
    ASSERT_TRUE(f.camera.try_share()) << i;
    EXPECT_FALSE(f.camera.try_share()) << "it is shared already";
    theirs.push_back(frame);
    f.camera.release();
  }
  for (int i = 0; i < 10; ++i) {
    f.feed();
    ASSERT_TRUE(f.acquire(frame)) << i;
    EXPECT_FALSE(f.camera.try_share()) << "no more than four";
    f.camera.release();
  }
  for (int i = 0; i < 4; ++i) EXPECT_EQ(theirs[static_cast<std::size_t>(i)].depth[5], 101 + i);
  EXPECT_EQ(f.device.empty_buffers(), 4U);
  f.camera.release_shared(theirs[2].depth);
  f.camera.release_shared(theirs[2].depth);
  EXPECT_EQ(f.device.empty_buffers(), 5U) << "once, and in any order";
  for (const DepthFrameView& picture : theirs) f.camera.release_shared(picture.depth);
  EXPECT_EQ(f.device.empty_buffers(), 8U);
}

TEST(V4l2Camera, TryAcquire_NoPictureForTheTimeout_IsOpenedAnewByMaintain) {
  Fixture f;
  f.open({.device = "/dev/video7", .intrinsics = kCamera, .timeout_ns = 1'000'000});
  f.feed();
  DepthFrameView frame;
  ASSERT_TRUE(f.acquire(frame));
  const std::uint32_t sequence = frame.sequence;
  f.camera.release();
  while (!f.camera.is_lost()) ASSERT_FALSE(f.acquire(frame));
  EXPECT_EQ(f.camera.counters().timeouts, 1U);
  const int before = f.device.streams_started;
  f.camera.maintain();
  EXPECT_FALSE(f.camera.is_lost());
  EXPECT_EQ(f.device.streams_started, before + 1);
  ASSERT_TRUE(f.picture());  // the kernel numbers from 0 again
  ASSERT_TRUE(f.acquire(frame));
  EXPECT_GT(frame.sequence, sequence);
  EXPECT_EQ(f.camera.reopen_counters().reopened.load(), 1U);
}

TEST(V4l2Camera, TryAcquire_UnpluggedWhileHeld_ViewStaysUntilRelease) {
  Fixture f;
  f.feed();
  DepthFrameView held, frame;
  ASSERT_TRUE(f.acquire(held));
  const int mapped = f.calls.mappings();
  f.device.present = false;
  EXPECT_FALSE(f.acquire(frame));
  EXPECT_FALSE(f.camera.is_lost()) << "a picture is held";
  f.camera.maintain();
  EXPECT_EQ(f.calls.mappings(), mapped);
  EXPECT_EQ(held.depth[0], 101);
  f.camera.release();
  EXPECT_TRUE(f.camera.is_lost());
  f.camera.maintain();
  EXPECT_EQ(f.camera.reopen_counters().failed.load(), 1U);
  EXPECT_EQ(f.calls.mappings(), 0);
  EXPECT_EQ(f.calls.open_descriptors(), 0);
  f.device.present = true;
  f.camera.maintain();
  ASSERT_TRUE(f.picture());
  ASSERT_TRUE(f.acquire(frame));
  EXPECT_GT(frame.sequence, held.sequence);
}

TEST(V4l2Camera, TryAcquire_IoErrors_ThreeInARowGiveTheStreamUp) {
  Fixture f;
  DepthFrameView frame;
  f.calls.fail(test::Call::kIoctl, EIO, 2);
  EXPECT_FALSE(f.acquire(frame));
  EXPECT_FALSE(f.acquire(frame));
  ASSERT_TRUE(f.picture());
  EXPECT_TRUE(f.acquire(frame)) << "it passed";
  f.camera.release();
  f.calls.fail(test::Call::kIoctl, EIO, 3);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(f.acquire(frame));
  EXPECT_TRUE(f.camera.is_lost());
  EXPECT_EQ(f.camera.counters().io_errors, 5U);
}

TEST(V4l2Camera, TryAcquire_DriverNamesABufferThatIsNot_IsGivenUp) {
  Fixture f;
  DepthFrameView frame;
  f.device.lie_about_index = 8;
  ASSERT_TRUE(f.picture());
  EXPECT_FALSE(f.acquire(frame));
  EXPECT_TRUE(f.camera.is_lost());
  EXPECT_EQ(f.camera.counters().failed_calls, 1U);
}

TEST(V4l2Camera, Maintain_InAnotherThread_HandsTheStreamOver) {
  Fixture f;
  DepthFrameView frame;
  for (int i = 0; i < 50; ++i) {
    f.calls.fail(test::Call::kIoctl, ENODEV);
    EXPECT_FALSE(f.camera.try_acquire(frame));
    ASSERT_TRUE(f.camera.is_lost());
    std::thread service([&f] { f.camera.maintain(); });
    while (f.camera.is_lost()) static_cast<void>(f.camera.try_acquire(frame));
    service.join();
    ASSERT_TRUE(f.picture());
    ASSERT_TRUE(f.camera.try_acquire(frame));
    f.camera.release();
  }
}

TEST(V4l2Camera, Open_ThatCannotBe_SaysWhy) {
  test::FakeV4l2 device;
  test::ScriptedCalls calls(test::FakeV4l2::calls());
  hal::V4l2Camera camera(calls.table());
  const hal::V4l2Camera::Config good{.device = "/dev/video7", .intrinsics = kCamera};
  const auto sentence = [&](const hal::V4l2Camera::Config& config) {
    return std::string(camera.open(config).sentence());
  };
  EXPECT_EQ(sentence({}), "depth camera: a device's path has 1 to 63 characters");
  auto config = good;
  config.intrinsics.width_px = 1280;
  EXPECT_EQ(sentence(config), "/dev/video7: 1280x48 pixels: the module takes 1x1 to 640x480");
  config = good;
  config.buffers = 3;
  EXPECT_EQ(sentence(config), "/dev/video7: 3 buffers: 4 to 8 are needed");
  device.present = false;
  EXPECT_EQ(sentence(good), "/dev/video7: cannot open: No such file or directory");
  device.present = true;
  device.capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  EXPECT_EQ(sentence(good), "/dev/video7: does not stream pictures");
  device.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  device.widest_px = 32;
  EXPECT_EQ(sentence(good), "/dev/video7: gives no 64x48 Z16 but 32x48 of another format or size");
  device.widest_px = 640;
  device.row_padding_bytes = 64;
  EXPECT_EQ(sentence(good), "/dev/video7: pads a row of 64 pixels to 192 bytes");
  device.row_padding_bytes = 0;
  config = good;
  config.frames_per_s = 30;
  device.most_frames_per_s = 6;
  EXPECT_EQ(sentence(config), "/dev/video7: gives 6.00 pictures a second instead of 30");
  device.most_buffers = 3;
  EXPECT_EQ(sentence(good), "/dev/video7: gives 3 buffers of the 4 that are needed");
  device.most_buffers = 32;
  device.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  EXPECT_EQ(sentence(good), "/dev/video7: does not stamp pictures in the monotonic clock");
  EXPECT_EQ(calls.open_descriptors(), 0);
  EXPECT_EQ(calls.mappings(), 0);
}

struct Outcome {
  bool opened = false;
  int acquired = 0;
  std::uint32_t failures = 0;
};
Outcome open_and_use(test::FakeV4l2& device, test::ScriptedCalls& calls) {
  Outcome o;
  hal::V4l2Camera camera(calls.table());
  const hal::DeviceError error = camera.open({.device = "/dev/video7", .intrinsics = kCamera, .frames_per_s = 30});
  o.opened = !error.failed();
  if (!o.opened) {
    EXPECT_EQ(std::string(error.sentence()).find("/dev/video7: "), 0U);
  }
  std::int64_t stamp_ns = test::monotonic_now_ns() / 1000 * 1000;  // V4L2 has microseconds
  for (std::uint16_t i = 1, newest = 0; o.opened && i <= 8; ++i) {
    static_cast<void>(device.picture(i, stamp_ns += 1'000'000));
    DepthFrameView frame;
    if (camera.try_acquire(frame)) {
      ++o.acquired;
      EXPECT_LE(frame.depth[17], i);
      EXPECT_GT(frame.depth[17], newest);
      newest = frame.depth[17];
      camera.release();
    }
    camera.maintain();
  }
  const auto& c = camera.counters();
  o.failures = c.failed_calls + c.interrupted + c.io_errors + c.timeouts;
  return o;
}

TEST(V4l2Camera, EverySystemCall_EveryFault_IsToldOrCountedAndNothingLeaks) {
  std::size_t calls_made = 0, calls_to_open = 0;
  {
    test::FakeV4l2 device;
    test::ScriptedCalls calls(test::FakeV4l2::calls());
    hal::V4l2Camera camera(calls.table());
    ASSERT_FALSE(camera.open({.device = "/dev/video7", .intrinsics = kCamera, .frames_per_s = 30}).failed());
    calls_to_open = calls.all_calls();
  }
  {
    test::FakeV4l2 device;
    test::ScriptedCalls calls(test::FakeV4l2::calls());
    const Outcome o = open_and_use(device, calls);
    EXPECT_EQ(o.acquired, 8);
    calls_made = calls.all_calls();
    EXPECT_EQ(calls.open_descriptors(), 0);
    EXPECT_EQ(calls.mappings(), 0);
  }
  ASSERT_GT(calls_made, calls_to_open + 20);
  for (const int error_number : test::kErrors) {
    for (std::size_t nth = 0; nth < calls_made; ++nth) {
      test::FakeV4l2 device;
      test::ScriptedCalls calls(test::FakeV4l2::calls());
      calls.fail_any(nth, error_number);
      const Outcome o = open_and_use(device, calls);
      EXPECT_EQ(calls.open_descriptors(), 0) << nth << " " << error_number;
      EXPECT_EQ(calls.mappings(), 0) << nth << " " << error_number;
      ASSERT_TRUE(calls.failed_any());
      const test::Call hit = *calls.failed_any();
      // While opening, EINTR is answered by trying again. A clock that cannot be read only puts a timeout off.
      const bool harmless = hit == test::Call::kClose || hit == test::Call::kMunmap ||
                            hit == test::Call::kClockGettime || error_number == EINTR ||
                            (nth >= calls_to_open && error_number == EAGAIN);
      EXPECT_TRUE(harmless || !o.opened || o.failures > 0) << nth << " " << error_number;
      if (o.opened) {
        EXPECT_GE(o.acquired, 5) << nth << " " << error_number;
      }
    }
  }
}

}  // namespace
}  // namespace polygmap
