// SPDX-License-Identifier: Apache-2.0
// The depth camera's driver on the kernel's virtual camera (module vivid), which makes Y16 pictures with a running
// number in them and faults on demand. Skips where there is none.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstring>
#include <string>

#include "hal/linux/v4l2_camera.hpp"
#include "tests/hal/linux/clock_now.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace {

// The path of vivid's first capture node; empty: there is none.
[[nodiscard]] std::string vivid_capture() {
  for (int i = 0; i < 32; ++i) {
    const std::string path = "/dev/video" + std::to_string(i);
    const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK);
    if (fd < 0) continue;
    v4l2_capability c{};
    const bool is_it = ::ioctl(fd, VIDIOC_QUERYCAP, &c) == 0 &&
                       std::strcmp(reinterpret_cast<const char*>(c.driver), "vivid") == 0 &&
                       (c.device_caps & V4L2_CAP_VIDEO_CAPTURE) != 0;
    ::close(fd);
    if (is_it) return path;
  }
  return {};
}

struct Vivid {
  std::string path = vivid_capture();
  int controls = path.empty() ? -1 : ::open(path.c_str(), O_RDWR | O_NONBLOCK);
  test::ScriptedCalls calls;
  hal::V4l2Camera camera{calls.table()};
  std::int64_t stamp_ns = 0;  // of the last picture

  Vivid() {
    calls.after_ioctl = [this](unsigned long request, void* argument) {
      if (request != VIDIOC_DQBUF) return;
      const timeval& t = static_cast<v4l2_buffer*>(argument)->timestamp;
      stamp_ns = t.tv_sec * 1'000'000'000 + t.tv_usec * 1000;
    };
    if (path.empty()) return;
    const hal::DeviceError error = camera.open(config());
    EXPECT_FALSE(error.failed()) << error.sentence();
  }
  ~Vivid() {
    camera.close();
    EXPECT_EQ(calls.open_descriptors(), 0);
    EXPECT_EQ(calls.mappings(), 0);
    if (controls >= 0) ::close(controls);
  }
  Vivid(const Vivid&) = delete;
  Vivid& operator=(const Vivid&) = delete;
  [[nodiscard]] hal::V4l2Camera::Config config() const {
    return {.device = path,
            .intrinsics = {.width_px = 640, .height_px = 480, .fx_px = 400, .fy_px = 400, .cx_px = 320, .cy_px = 240},
            .format = hal::V4l2Camera::PixelFormat::kY16,
            .frames_per_s = 15,
            .timeout_ns = 2'000'000'000};
  }
  const char* absent() { return path.empty() ? "no virtual camera (vivid) here" : nullptr; }
  hal::DepthCamera& port() { return camera; }
  // Until done() or, with a complaint, for five seconds.
  template <typename Done>
  void poll_until(Done&& done) {
    const std::int64_t end_ns = test::monotonic_now_ns() + 5'000'000'000;
    while (!done()) {
      if (test::monotonic_now_ns() > end_ns) {
        ADD_FAILURE() << "it did not come within five seconds";
        return;
      }
      ::usleep(500);
      camera.poll();
    }
  }
  std::int64_t feed() {
    const std::uint32_t before = camera.counters().good;
    poll_until([&] { return camera.counters().good > before; });
    return stamp_ns;
  }
  void set_control(const char* name, int value) {
    v4l2_queryctrl query{};
    query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (::ioctl(controls, VIDIOC_QUERYCTRL, &query) == 0) {
      if (std::strcmp(reinterpret_cast<const char*>(query.name), name) == 0) {
        v4l2_control control{.id = query.id, .value = value};
        EXPECT_EQ(::ioctl(controls, VIDIOC_S_CTRL, &control), 0) << name;
        return;
      }
      query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    ADD_FAILURE() << "vivid has no control '" << name << "'";
  }
};

}  // namespace

namespace contract {
struct VividHarness : Vivid {
  static constexpr int kFlood = 10;
};
INSTANTIATE_TYPED_TEST_SUITE_P(Vivid, DepthCameraContract, VividHarness);
}  // namespace contract

namespace {

class V4l2Vivid : public ::testing::Test {
 protected:
  void SetUp() override {
    if (vivid.absent() != nullptr) GTEST_SKIP() << vivid.absent();
  }
  Vivid vivid;
};

TEST_F(V4l2Vivid, TryAcquire_ThirtyPictures_AtTheRateAskedForAndStampedNow) {
  DepthFrameView frame;
  std::int64_t first_ns = 0, last_ns = 0;
  for (int i = 0; i < 30; ++i) {
    vivid.feed();
    ASSERT_TRUE(vivid.camera.try_acquire(frame));
    EXPECT_LT(std::abs(test::monotonic_now_ns() - frame.stamp_ns), 200'000'000);
    if (i == 0) first_ns = frame.stamp_ns;
    last_ns = frame.stamp_ns;
    vivid.camera.release();
  }
  EXPECT_NEAR(static_cast<double>(last_ns - first_ns) * 1e-9, 29.0 / 15.0, 0.1);
}

TEST_F(V4l2Vivid, TryAcquire_FaultyPictureInjected_IsCountedAndNotGiven) {
  vivid.set_control("Inject V4L2_BUF_FLAG_ERROR", 1);
  vivid.poll_until([&] { return vivid.camera.counters().flagged == 1; });
  vivid.feed();
  EXPECT_FALSE(vivid.camera.is_lost());
}

TEST_F(V4l2Vivid, TryAcquire_PicturesDropped_GapsAreCounted) {
  vivid.set_control("Percentage of Dropped Buffers", 50);
  vivid.poll_until([&] { return vivid.camera.counters().missing > 2; });
  vivid.set_control("Percentage of Dropped Buffers", 0);
}

TEST_F(V4l2Vivid, TryAcquire_FatalStreamingError_StreamIsOpenedAnew) {
  vivid.feed();
  DepthFrameView before, after;
  ASSERT_TRUE(vivid.camera.try_acquire(before));
  vivid.camera.release();
  vivid.set_control("Inject Fatal Streaming Error", 1);
  vivid.poll_until([&] { return vivid.camera.is_lost(); });
  EXPECT_GE(vivid.camera.counters().io_errors, 3U);
  vivid.set_control("Inject VIDIOC_STREAMON Error", 1);
  vivid.camera.maintain();
  EXPECT_TRUE(vivid.camera.is_lost());
  EXPECT_EQ(vivid.camera.reopen_counters().failed.load(), 1U);
  vivid.camera.maintain();
  ASSERT_FALSE(vivid.camera.is_lost());
  vivid.feed();
  ASSERT_TRUE(vivid.camera.try_acquire(after));
  EXPECT_GT(after.sequence, before.sequence);
  EXPECT_GT(after.stamp_ns, before.stamp_ns);
}

TEST_F(V4l2Vivid, Open_FormatThatItHasNot_SaysWhy) {
  hal::V4l2Camera second;
  auto config = vivid.config();
  config.format = hal::V4l2Camera::PixelFormat::kZ16;
  vivid.camera.close();
  const hal::DeviceError error = second.open(config);
  EXPECT_EQ(error.kind, hal::DeviceErrorKind::kUnsuitable) << error.sentence();
}

}  // namespace
}  // namespace polygmap
