// SPDX-License-Identifier: Apache-2.0
// The depth camera's driver on the kernel's virtual camera (module vivid), which makes Y16 pictures with a running
// number in them and faults on demand. Skips where there is none.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "hal/linux/v4l2_camera.hpp"
#include "tests/hal/linux/clock_now.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace {

// The path of vivid's first node that can do this; empty: there is none.
[[nodiscard]] std::string vivid_node(std::uint32_t capability) {
  for (int i = 0; i < 32; ++i) {
    const std::string path = "/dev/video" + std::to_string(i);
    const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK);
    if (fd < 0) continue;
    v4l2_capability c{};
    const bool is_it = ::ioctl(fd, VIDIOC_QUERYCAP, &c) == 0 &&
                       std::strcmp(reinterpret_cast<const char*>(c.driver), "vivid") == 0 &&
                       (c.device_caps & capability) != 0;
    ::close(fd);
    if (is_it) return path;
  }
  return {};
}

struct Vivid {
  std::string path = vivid_node(V4L2_CAP_VIDEO_CAPTURE);
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

TEST_F(V4l2Vivid, TryAcquire_ThirtyPictures_AtTheDevicesRateAndStampedNow) {
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  ASSERT_EQ(::ioctl(vivid.controls, VIDIOC_G_PARM, &rate), 0);
  const v4l2_fract& period = rate.parm.capture.timeperframe;
  DepthFrameView frame;
  std::int64_t first_ns = 0, last_ns = 0;
  std::uint32_t first = 0, last = 0;
  for (int i = 0; i < 30; ++i) {
    vivid.feed();
    ASSERT_TRUE(vivid.camera.try_acquire(frame));
    EXPECT_LT(std::abs(test::monotonic_now_ns() - frame.stamp_ns), 200'000'000);
    if (i == 0) {
      first_ns = frame.stamp_ns;
      first = frame.sequence;
    }
    last_ns = frame.stamp_ns;
    last = frame.sequence;
    vivid.camera.release();
  }
  const double period_s = static_cast<double>(last_ns - first_ns) * 1e-9 / (last - first);
  EXPECT_NEAR(period_s, static_cast<double>(period.numerator) / period.denominator, 0.1 * period_s);
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

// Needs vivid's HDMI input and output as its first ones: modprobe vivid input_types=0x3 num_inputs=1 output_types=0x1
// num_outputs=1.
TEST_F(V4l2Vivid, TryAcquire_PictureOfTheOutputLooped_IsTheSamePixelForPixel) {
  const std::string output_path = vivid_node(V4L2_CAP_VIDEO_OUTPUT);
  if (output_path.empty()) GTEST_SKIP() << "this virtual camera has no output";
  vivid.camera.close();
  const int output = ::open(output_path.c_str(), O_RDWR | O_NONBLOCK);
  ASSERT_GE(output, 0);
  std::array<void*, 4> memory{};
  std::uint32_t next = 0;
  // Hands the picture to the output, unless all its buffers still wait to be shown.
  const auto show = [&](const std::vector<std::uint16_t>& pixels) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (next < memory.size()) {
      buffer.index = next++;
    } else if (::ioctl(output, VIDIOC_DQBUF, &buffer) != 0) {
      return;
    }
    std::copy(pixels.begin(), pixels.end(), static_cast<std::uint16_t*>(memory[buffer.index]));
    buffer.bytesused = static_cast<std::uint32_t>(2 * pixels.size());
    buffer.field = V4L2_FIELD_NONE;
    EXPECT_EQ(::ioctl(output, VIDIOC_QBUF, &buffer), 0);
  };
  v4l2_dv_timings timings{};  // 640x480 at 59.94 Hz of CEA-861
  timings.type = V4L2_DV_BT_656_1120;
  timings.bt.width = 640;
  timings.bt.height = 480;
  timings.bt.pixelclock = 25'175'000;
  timings.bt.hfrontporch = 16;
  timings.bt.hsync = 96;
  timings.bt.hbackporch = 48;
  timings.bt.vfrontporch = 10;
  timings.bt.vsync = 2;
  timings.bt.vbackporch = 33;
  timings.bt.standards = V4L2_DV_BT_STD_DMT | V4L2_DV_BT_STD_CEA861;
  if (::ioctl(vivid.controls, VIDIOC_S_DV_TIMINGS, &timings) != 0) {
    ::close(output);
    GTEST_SKIP() << "its input is no HDMI input";
  }
  EXPECT_EQ(::ioctl(output, VIDIOC_S_DV_TIMINGS, &timings), 0);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = 640;
  format.fmt.pix.height = 480;
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_Y16;
  EXPECT_EQ(::ioctl(output, VIDIOC_S_FMT, &format), 0);
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(memory.size());
  request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  request.memory = V4L2_MEMORY_MMAP;
  EXPECT_EQ(::ioctl(output, VIDIOC_REQBUFS, &request), 0);
  for (std::uint32_t i = 0; i < memory.size(); ++i) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    EXPECT_EQ(::ioctl(output, VIDIOC_QUERYBUF, &buffer), 0);
    memory[i] = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, output, buffer.m.offset);
    ASSERT_NE(memory[i], MAP_FAILED);
  }
  std::vector<std::uint16_t> picture(640 * 480);
  for (std::size_t i = 0; i < memory.size(); ++i) show(picture);
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  EXPECT_EQ(::ioctl(output, VIDIOC_STREAMON, &type), 0);
  vivid.set_control("OSD Text Mode", 2);
  vivid.set_control("Loop Video", 1);
  const hal::DeviceError error = vivid.camera.open(vivid.config());
  EXPECT_FALSE(error.failed()) << error.sentence();
  std::mt19937 random(11);
  for (int i = 0; i < 3; ++i) {
    for (std::uint16_t& pixel : picture) pixel = static_cast<std::uint16_t>(random());
    bool same = false;
    vivid.poll_until([&] {
      show(picture);
      DepthFrameView frame;
      if (vivid.camera.try_acquire(frame)) {
        same = std::equal(picture.begin(), picture.end(), frame.depth);
        vivid.camera.release();
      }
      return same;
    });
    EXPECT_TRUE(same);
  }
  vivid.set_control("Loop Video", 0);
  vivid.set_control("OSD Text Mode", 0);
  for (void* mapped : memory) ::munmap(mapped, 2 * picture.size());
  ::close(output);
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
