// SPDX-License-Identifier: Apache-2.0
// Which of a camera's few buffers is where: with the kernel, waiting for the module, or held. No system call in it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

class BufferBook {
 public:
  static constexpr std::size_t kMostBuffers = 8;
  // Who may hold a picture: the module, and one who looks at what the module holds (a recorder).
  enum class Holder : std::uint8_t { kModule, kSecond };
  static constexpr std::size_t kHolders = 2;
  using Index = std::uint32_t;

  // All buffers are with the kernel, at most most_waiting (at least 1) will wait. Whatever was held is forgotten.
  constexpr void reset(std::size_t most_waiting) noexcept {
    most_waiting_ = most_waiting;
    waiting_.clear();
    held_ = {};
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
    Held& mine = held_by(Holder::kModule);
    Entry oldest{};
    if (mine.any || !waiting_.try_pop(oldest)) return false;
    mine = {true, oldest};
    view = oldest.view;
    return true;
  }
  // The second holder takes what the module holds. False, and view untouched, when it holds one or the module none.
  [[nodiscard]] constexpr bool share(DepthFrameView& view) noexcept {
    const Held& shared = held_by(Holder::kModule);
    if (held_by(Holder::kSecond).any || !shared.any) return false;
    held_by(Holder::kSecond) = shared;
    view = shared.entry.view;
    return true;
  }
  // The buffer to be handed back, when nobody else holds it.
  [[nodiscard]] constexpr std::optional<Index> give_back(Holder holder) noexcept {
    Held& mine = held_by(holder);
    if (!mine.any) return std::nullopt;
    const Index buffer = mine.entry.buffer;
    mine = {};
    for (const Held& other : held_) {
      if (other.any && other.entry.buffer == buffer) return std::nullopt;
    }
    return buffer;
  }
  constexpr void forget_waiting() noexcept { waiting_.clear(); }
  [[nodiscard]] constexpr bool any_held() const noexcept { return held_[0].any || held_[1].any; }
  [[nodiscard]] constexpr std::size_t waiting() const noexcept { return waiting_.size(); }

 private:
  struct Entry {
    Index buffer;
    DepthFrameView view;
  };
  struct Held {
    bool any = false;
    Entry entry{};
  };
  [[nodiscard]] constexpr Held& held_by(Holder holder) noexcept {
    return held_[static_cast<std::size_t>(holder)];
  }

  std::size_t most_waiting_ = 1;
  RingBuffer<Entry, kMostBuffers> waiting_;
  std::array<Held, kHolders> held_{};
};

}  // namespace polygmap::hal
