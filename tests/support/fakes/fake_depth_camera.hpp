// SPDX-License-Identifier: Apache-2.0
// Plays back the frames a test feeds. Like a driver it has a few buffers: the oldest frame that nobody holds makes
// room; beside them it keeps some for a second holder. Heap only in the constructor, so that a trap may be armed while
// the module calls it.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/depth_camera.hpp"
#include "hal/ports/picture_keeper.hpp"
#include "tests/support/fakes/call_script.hpp"

namespace polygmap::fakes {

class FakeDepthCamera final : public hal::DepthCamera, public hal::PictureKeeper {
 public:
  static constexpr std::size_t kQueue = 2;  // frames that wait, beside the one held

  explicit FakeDepthCamera(const CameraIntrinsics& intrinsics) : intrinsics_(intrinsics) {
    for (auto& buffer : buffers_) buffer.resize(pixels());
    for (Kept& kept : kept_) kept.pixels.resize(pixels());
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
  // The driver writes into the buffer at once, unless it was kept.
  void release() noexcept override {
    if (holding_ && keeps_held_) {
      const auto room = std::ranges::find(kept_, false, &Kept::is_there);
      room->pixels.swap(buffers_[held_.buffer]);
      room->is_there = true;
    }
    if (holding_) std::ranges::fill(buffers_[held_.buffer], std::uint16_t{12345});
    holding_ = keeps_held_ = false;
  }
  CallScript keeps;
  [[nodiscard]] int kept() const noexcept { return kept_ever_; }
  [[nodiscard]] int still_kept() const noexcept {
    return static_cast<int>(std::ranges::count(kept_, true, &Kept::is_there)) + (keeps_held_ ? 1 : 0);
  }
  [[nodiscard]] bool try_keep(const DepthFrameView& frame) noexcept override {
    const bool has_room = std::ranges::find(kept_, false, &Kept::is_there) != kept_.end();
    if (keeps.next_fails() || !holding_ || keeps_held_ || frame.depth != held_.view.depth || !has_room) return false;
    keeps_held_ = true;
    ++kept_ever_;
    return true;
  }
  // Written into at once, too.
  void let_go(const std::uint16_t* pixels) noexcept override {
    if (holding_ && pixels == held_.view.depth) keeps_held_ = false;
    for (Kept& kept : kept_) {
      if (!kept.is_there || kept.pixels.data() != pixels) continue;
      std::ranges::fill(kept.pixels, std::uint16_t{54321});
      kept.is_there = false;
    }
  }

 private:
  struct Entry {
    std::size_t buffer;
    DepthFrameView view;
  };

  struct Kept {
    std::vector<std::uint16_t> pixels;
    bool is_there = false;
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
  bool holding_ = false, keeps_held_ = false;
  std::array<Kept, kMostKept> kept_;
  int kept_ever_ = 0;
  std::uint32_t sequence_ = 0;
};

}  // namespace polygmap::fakes
