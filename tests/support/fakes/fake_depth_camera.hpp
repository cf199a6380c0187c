// SPDX-License-Identifier: Apache-2.0
// Plays back the frames a test feeds. Like a driver it has a few buffers: the oldest frame that nobody holds makes
// room. Heap only in the constructor, so that a trap may be armed while the module calls it.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/depth_camera.hpp"
#include "tests/support/fakes/call_script.hpp"

namespace polygmap::fakes {

class FakeDepthCamera final : public hal::DepthCamera {
 public:
  static constexpr std::size_t kQueue = 2;  // frames that wait, beside the one held

  explicit FakeDepthCamera(const CameraIntrinsics& intrinsics) : intrinsics_(intrinsics) {
    for (auto& buffer : buffers_) buffer.resize(pixels());
  }

  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(intrinsics_.width_px) * static_cast<std::size_t>(intrinsics_.height_px);
  }
  // A picture of another size than the intrinsics say is cut, or filled up with 0 (invalid).
  void feed(std::int64_t stamp_ns, std::span<const std::uint16_t> depth) noexcept {
    const std::size_t buffer = free_buffer();
    const std::size_t count = std::min(depth.size(), pixels());
    std::fill(std::copy_n(depth.begin(), count, buffers_[buffer].begin()), buffers_[buffer].end(), std::uint16_t{0});
    waiting_.push_overwrite(
        {buffer, {stamp_ns, sequence_++, intrinsics_.width_px, intrinsics_.height_px, buffers_[buffer].data()}});
  }
  CallScript acquisitions;  // a failing one leaves the frames where they are
  [[nodiscard]] bool holding() const noexcept { return holding_; }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return intrinsics_; }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (acquisitions.next_fails() || holding_ || !waiting_.try_pop(held_)) return false;
    frame = held_.view;
    holding_ = true;
    return true;
  }
  // The driver writes into the buffer at once.
  void release() noexcept override {
    if (holding_) buffers_[held_.buffer].assign(pixels(), std::uint16_t{12345});
    holding_ = false;
  }

 private:
  struct Entry {
    std::size_t buffer;
    DepthFrameView view;
  };

  // One more buffer than can wait and be held at a time; when the queue is full its oldest frame is about to go.
  [[nodiscard]] std::size_t free_buffer() const noexcept {
    for (std::size_t b = 0; b < buffers_.size(); ++b) {
      bool used = holding_ && held_.buffer == b;
      for (std::size_t i = waiting_.full() ? 1 : 0; i < waiting_.size(); ++i) used = used || waiting_[i].buffer == b;
      if (!used) return b;
    }
    return 0;
  }

  CameraIntrinsics intrinsics_;
  std::array<std::vector<std::uint16_t>, kQueue + 1> buffers_;
  RingBuffer<Entry, kQueue> waiting_;
  Entry held_{};
  bool holding_ = false;
  std::uint32_t sequence_ = 0;
};

}  // namespace polygmap::fakes
