// SPDX-License-Identifier: Apache-2.0
// A capture device made up behind the system calls: a queue of empty buffers, a queue of filled ones, and pictures that
// are dropped when no buffer is empty. One lives at a time.
#pragma once

#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <vector>

#include "hal/linux/system/system_calls.hpp"
#include "tests/hal/linux/clock_now.hpp"

namespace polygmap::test {

class FakeV4l2 {
 public:
  FakeV4l2() { active() = this; }
  ~FakeV4l2() { active() = nullptr; }
  FakeV4l2(const FakeV4l2&) = delete;
  FakeV4l2& operator=(const FakeV4l2&) = delete;

  // What the device is like.
  bool present = true;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::uint32_t widest_px = 640;
  std::uint32_t row_padding_bytes = 0;
  std::uint32_t most_buffers = 32;
  std::uint32_t most_frames_per_s = 90;
  std::uint32_t stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  // Of the next pictures.
  std::uint32_t buffer_flags = 0;
  std::uint32_t missing_bytes = 0;
  std::uint32_t lie_about_index = 0;
  // What it saw.
  std::uint32_t frames_per_s = 0;
  int streams_started = 0;
  int buffers_asked = 0;

  // The device takes a picture of this value everywhere; false: dropped, for want of an empty buffer.
  bool picture(std::uint16_t value, std::int64_t stamp_ns) {
    const std::uint32_t number = sequence_++;
    if (!streaming_ || empty_.empty()) return false;
    v4l2_buffer b{};
    b.index = empty_.front();
    empty_.pop_front();
    std::vector<std::uint16_t>& pixels = memory_[b.index];
    std::fill(pixels.begin(), pixels.end(), value);
    b.bytesused = static_cast<std::uint32_t>(2 * pixels.size()) - missing_bytes;
    b.flags = stamp_flags | buffer_flags;
    b.sequence = number;
    b.timestamp = {stamp_ns / 1'000'000'000, stamp_ns % 1'000'000'000 / 1000};
    filled_.push_back(b);
    return true;
  }
  [[nodiscard]] std::size_t empty_buffers() const { return empty_.size(); }
  [[nodiscard]] bool streaming() const { return streaming_; }

  [[nodiscard]] static const hal::SystemCalls& calls() {
    static const hal::SystemCalls kCalls = [] {
      hal::SystemCalls c = hal::kernel_calls();
      c.open = [](const char*, int) noexcept { return active()->present ? 200 : fail(ENOENT); };
      c.close = [](int) noexcept {
        active()->stop();
        return 0;
      };
      c.mmap = [](std::size_t size, int, int, int, off_t offset) noexcept -> void* {
        auto& pixels = active()->memory_[static_cast<std::size_t>(offset)];
        return size == 2 * pixels.size() ? pixels.data() : MAP_FAILED;
      };
      c.munmap = [](void*, std::size_t) noexcept { return 0; };
      c.ioctl = [](int, unsigned long request, void* argument) noexcept {
        return active()->present ? active()->ioctl(request, argument) : fail(ENODEV);
      };
      return c;
    }();
    return kCalls;
  }

 private:
  static FakeV4l2*& active() {
    static FakeV4l2* one = nullptr;
    return one;
  }
  static int fail(int error_number) noexcept {
    errno = error_number;
    return -1;
  }
  void stop() {
    streaming_ = false;
    empty_.clear();
    filled_.clear();
    sequence_ = 0;
  }
  int ioctl(unsigned long request, void* argument) {
    if (request == VIDIOC_QUERYCAP) {
      static_cast<v4l2_capability*>(argument)->capabilities = capabilities;
    } else if (request == VIDIOC_S_FMT) {
      v4l2_pix_format& p = static_cast<v4l2_format*>(argument)->fmt.pix;
      p.width = std::min(p.width, widest_px);
      p.bytesperline = 2 * p.width + row_padding_bytes;
      p.sizeimage = p.bytesperline * p.height;
      for (auto& pixels : memory_) pixels.assign(p.width * p.height, 0);
    } else if (request == VIDIOC_S_PARM) {
      v4l2_fract& rate = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      rate.denominator = frames_per_s = std::min(rate.denominator, most_frames_per_s);
    } else if (request == VIDIOC_REQBUFS) {
      auto& r = *static_cast<v4l2_requestbuffers*>(argument);
      buffers_asked = static_cast<int>(r.count);
      r.count = std::min(r.count, most_buffers);
    } else if (request == VIDIOC_QUERYBUF) {
      auto& b = *static_cast<v4l2_buffer*>(argument);
      b.length = static_cast<std::uint32_t>(2 * memory_[b.index].size());
      b.m.offset = b.index;
      b.flags = stamp_flags;
    } else if (request == VIDIOC_QBUF) {
      const std::uint32_t index = static_cast<v4l2_buffer*>(argument)->index;
      // The driver writes into it at once: a view that is still read would show.
      std::fill(memory_[index].begin(), memory_[index].end(), std::uint16_t{54'321});
      empty_.push_back(index);
    } else if (request == VIDIOC_STREAMON) {
      streaming_ = true;
      ++streams_started;
    } else if (request == VIDIOC_DQBUF) {
      if (!streaming_) return fail(EINVAL);
      if (filled_.empty()) return fail(EAGAIN);
      auto& b = *static_cast<v4l2_buffer*>(argument);
      b = filled_.front();
      b.index += lie_about_index;
      filled_.pop_front();
    } else {
      return fail(ENOTTY);
    }
    return 0;
  }

  std::array<std::vector<std::uint16_t>, 8> memory_;
  std::deque<std::uint32_t> empty_;
  std::deque<v4l2_buffer> filled_;
  bool streaming_ = false;
  std::uint32_t sequence_ = 0;
};

}  // namespace polygmap::test
