// SPDX-License-Identifier: Apache-2.0
// The output of the kernel's virtual camera, whose pictures its input gives: 30 a second of 640x480, 16 bits a pixel.
//
// Two buffers are queued, and vivid keeps showing the last one for want of another: what is written into it is what the
// input's next picture has in it. So a picture is shown at once, and not in step with an output that has a phase of its
// own. When the input takes its pictures is told by nobody; its format cannot be set from the moment on in which
// somebody has buffers of it, which is a moment before its stream starts.
#pragma once

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>

namespace polygmap::vm {

class VividOutput {
 public:
  static constexpr std::uint32_t kWidth_px = 640, kHeight_px = 480;
  static constexpr std::size_t kPicture_bytes = 2U * kWidth_px * kHeight_px;
  static constexpr std::uint32_t kOutputWidth_px = 1280, kOutputHeight_px = 720;
  static constexpr std::size_t kOutput_bytes = 2U * kOutputWidth_px * kOutputHeight_px;

  VividOutput() = default;
  VividOutput(const VividOutput&) = delete;
  VividOutput& operator=(const VividOutput&) = delete;

  // Empty, or what failed.
  [[nodiscard]] std::string open(const char* input_path, const char* output_path) {
    input_ = ::open(input_path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    output_ = ::open(output_path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (input_ < 0 || output_ < 0) return "cannot open the virtual camera";
    v4l2_dv_timings timings = thirty_a_second();
    if (ioctl(input_, VIDIOC_S_DV_TIMINGS, &timings) != 0) return "its input is no HDMI input";
    timings = thirty_a_second();
    if (ioctl(output_, VIDIOC_S_DV_TIMINGS, &timings) != 0) return "its output is no HDMI output";
    v4l2_format format = format_of(V4L2_BUF_TYPE_VIDEO_OUTPUT, kOutputWidth_px, kOutputHeight_px);
    if (ioctl(output_, VIDIOC_S_FMT, &format) != 0) return "its output takes no such pictures";
    if (input_is_taken()) return "its input is taken";
    v4l2_selection corner{};
    corner.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    corner.target = V4L2_SEL_TGT_CROP;
    corner.r = {0, 0, kWidth_px, kHeight_px};
    if (ioctl(input_, VIDIOC_S_SELECTION, &corner) != 0) return "its input cannot be cropped";
    if (std::string wrong = start(); !wrong.empty()) return wrong;
    for (const auto& [name, value] : {std::pair{"OSD Text Mode", 2}, std::pair{"Loop Video", 1}}) {
      if (!set_control(name, value)) return std::string("it has no control ") + name;
    }
    return {};
  }
  // Whether somebody has buffers of the input; sets its format as the daemon does until then.
  [[nodiscard]] bool input_is_taken() const {
    v4l2_format format = format_of(V4L2_BUF_TYPE_VIDEO_CAPTURE, kWidth_px, kHeight_px);
    return ioctl(input_, VIDIOC_S_FMT, &format) != 0 && errno == EBUSY;
  }
  void show(const char* pixels) noexcept {
    for (std::size_t row = 0; row < kHeight_px; ++row) {
      std::memcpy(static_cast<char*>(memory_[1]) + row * 2 * kOutputWidth_px, pixels + row * 2 * kWidth_px,
                  2 * kWidth_px);
    }
  }

 private:
  // 1280x720 of CEA-861, the smallest with 30 pictures a second. The input takes the upper left corner.
  static v4l2_dv_timings thirty_a_second() noexcept {
    v4l2_dv_timings timings{};
    timings.type = V4L2_DV_BT_656_1120;
    v4l2_bt_timings& bt = timings.bt;
    bt.width = kOutputWidth_px, bt.height = kOutputHeight_px;
    bt.polarities = V4L2_DV_VSYNC_POS_POL | V4L2_DV_HSYNC_POS_POL;
    bt.hfrontporch = 1760, bt.hsync = 40, bt.hbackporch = 220;
    bt.vfrontporch = 5, bt.vsync = 5, bt.vbackporch = 20;
    bt.pixelclock = 74'250'000;
    bt.standards = V4L2_DV_BT_STD_CEA861;
    return timings;
  }
  static v4l2_format format_of(std::uint32_t type, std::uint32_t width_px, std::uint32_t height_px) noexcept {
    v4l2_format format{};
    format.type = type;
    format.fmt.pix.width = width_px;
    format.fmt.pix.height = height_px;
    format.fmt.pix.pixelformat = V4L2_PIX_FMT_Y16;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    return format;
  }
  std::string start() {
    v4l2_requestbuffers request{};
    request.count = static_cast<std::uint32_t>(memory_.size());
    request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    request.memory = V4L2_MEMORY_MMAP;
    if (ioctl(output_, VIDIOC_REQBUFS, &request) != 0 || request.count != memory_.size()) return "it gives no buffers";
    for (std::uint32_t i = 0; i < memory_.size(); ++i) {
      v4l2_buffer buffer{};
      buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
      buffer.memory = V4L2_MEMORY_MMAP;
      buffer.index = i;
      if (ioctl(output_, VIDIOC_QUERYBUF, &buffer) != 0) return "its buffer cannot be looked at";
      memory_[i] = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, output_,
                        static_cast<off_t>(buffer.m.offset));
      if (memory_[i] == MAP_FAILED) return "its buffer cannot be mapped";
      std::memset(memory_[i], 0, kOutput_bytes);
      buffer.bytesused = kOutput_bytes;
      buffer.field = V4L2_FIELD_NONE;
      if (ioctl(output_, VIDIOC_QBUF, &buffer) != 0) return "it takes no picture";
    }
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    return ioctl(output_, VIDIOC_STREAMON, &type) == 0 ? std::string() : "its output does not start";
  }
  [[nodiscard]] bool set_control(std::string_view name, int value) const {
    v4l2_queryctrl query{};
    query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (ioctl(input_, VIDIOC_QUERYCTRL, &query) == 0) {
      v4l2_control control{.id = query.id, .value = value};
      if (name == reinterpret_cast<const char*>(query.name)) return ioctl(input_, VIDIOC_S_CTRL, &control) == 0;
      query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    return false;
  }

  int input_ = -1, output_ = -1;
  std::array<void*, 2> memory_{};
};

}  // namespace polygmap::vm
