// SPDX-License-Identifier: Apache-2.0
// Which of a camera's few buffers is where: with the kernel, waiting for the module, or held. No system call in it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

class BufferBook {
  struct Entry {
    std::uint32_t buffer;
    DepthFrameView view;
  };
  struct Held {
    bool any = false;
    Entry entry{};
  };

 public:
  static constexpr std::size_t kMostBuffers = 8;
  // The module holds one picture. A second holder, who looks at what the module holds (a recorder), holds a few.
  static constexpr std::size_t kMostShared = 4;
  using Index = std::uint32_t;

  // All of count (at least 4) buffers are with the kernel, which always keeps one to fill. Whatever was held is
  // forgotten.
  constexpr void reset(std::size_t count) noexcept {
    most_shared_ = std::clamp<std::size_t>(count, 5, 4 + kMostShared) - 4;
    most_waiting_ = count - 2 - most_shared_;
    waiting_.clear();
    held_ = {};
    shared_.clear();
  }
  // A filled buffer came from the kernel. The buffer that it pushed out of the queue, to be handed back.
  [[nodiscard]] constexpr std::optional<Index> arrived(Index buffer, const DepthFrameView& view) noexcept {
    std::optional<Index> pushed_out;
    if (Entry oldest{}; waiting_.size() >= most_waiting_ && waiting_.try_pop(oldest)) pushed_out = oldest.buffer;
    waiting_.push_overwrite({buffer, view});
    return pushed_out;
  }
  // The module takes the oldest that waits. False, and view untouched, when it holds one or none waits.
  [[nodiscard]] constexpr bool take(DepthFrameView& view) noexcept {
    Entry oldest{};
    if (held_.any || !waiting_.try_pop(oldest)) return false;
    held_ = {true, oldest};
    view = oldest.view;
    return true;
  }
  // The second holder takes what the module holds. False when the module holds none or the second holder has it, or as
  // many as it may.
  [[nodiscard]] constexpr bool share() noexcept {
    if (!held_.any || shared_.size() == most_shared_ || is_shared(held_.entry.buffer)) return false;
    return shared_.try_push_back(held_.entry);
  }
  // The module's buffer, to be handed back when nobody else holds it.
  [[nodiscard]] constexpr std::optional<Index> give_back() noexcept {
    if (!held_.any) return std::nullopt;
    held_.any = false;
    return is_shared(held_.entry.buffer) ? std::nullopt : std::optional<Index>(held_.entry.buffer);
  }
  // The same of the second holder's picture with these pixels.
  [[nodiscard]] constexpr std::optional<Index> give_back_shared(const std::uint16_t* pixels) noexcept {
    for (std::size_t i = 0; i < shared_.size(); ++i) {
      if (shared_[i].view.depth != pixels) continue;
      const Index buffer = shared_[i].buffer;
      (void)shared_.try_swap_remove(i);
      return held_.any && held_.entry.buffer == buffer ? std::nullopt : std::optional<Index>(buffer);
    }
    return std::nullopt;
  }
  constexpr void forget_waiting() noexcept { waiting_.clear(); }
  [[nodiscard]] constexpr bool any_held() const noexcept { return held_.any || !shared_.empty(); }
  [[nodiscard]] constexpr std::size_t waiting() const noexcept { return waiting_.size(); }

 private:
  [[nodiscard]] constexpr bool is_shared(Index buffer) const noexcept {
    return std::any_of(shared_.begin(), shared_.end(), [buffer](const Entry& e) { return e.buffer == buffer; });
  }

  std::size_t most_waiting_ = 1, most_shared_ = 1;
  RingBuffer<Entry, kMostBuffers> waiting_;
  Held held_;
  StaticVector<Entry, kMostShared> shared_;
};

}  // namespace polygmap::hal
