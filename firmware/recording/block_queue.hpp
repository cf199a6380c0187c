// SPDX-License-Identifier: Apache-2.0
// Blocks of bytes from one thread to one other, in memory that somebody else owns. Nobody waits.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace polygmap::recording {

class BlockQueue {
 public:
  explicit BlockQueue(std::span<std::byte> memory) noexcept : memory_(memory) {}

  // On the writer's thread: both parts, as one block. False, and nothing of it is there, when it has no room.
  [[nodiscard]] bool try_push(std::span<const std::byte> head, std::span<const std::byte> body) noexcept {
    const std::size_t length = head.size() + body.size();
    const std::size_t begin = pushed_.load(std::memory_order_relaxed);
    const std::size_t used = begin - popped_.load(std::memory_order_acquire);
    if (kLength_bytes + length > memory_.size() - used) return false;
    const auto prefix = static_cast<std::uint32_t>(length);
    put(begin, {reinterpret_cast<const std::byte*>(&prefix), kLength_bytes});
    put(begin + kLength_bytes, head);
    put(begin + kLength_bytes + head.size(), body);
    pushed_.store(begin + kLength_bytes + length, std::memory_order_release);
    return true;
  }
  // On the reader's thread: the oldest block; empty when there is none. A block that into does not hold is cut off.
  [[nodiscard]] std::span<std::byte> pop(std::span<std::byte> into) noexcept {
    const std::size_t begin = popped_.load(std::memory_order_relaxed);
    if (pushed_.load(std::memory_order_acquire) == begin) return {};
    std::uint32_t length = 0;
    get(begin, {reinterpret_cast<std::byte*>(&length), kLength_bytes});
    const std::span<std::byte> block = into.first(std::min<std::size_t>(length, into.size()));
    get(begin + kLength_bytes, block);
    popped_.store(begin + kLength_bytes + length, std::memory_order_release);
    return block;
  }

 private:
  static constexpr std::size_t kLength_bytes = sizeof(std::uint32_t);

  void put(std::size_t place, std::span<const std::byte> bytes) noexcept {
    const std::size_t at = place % memory_.size(), first = std::min(bytes.size(), memory_.size() - at);
    if (first > 0) std::memcpy(memory_.data() + at, bytes.data(), first);
    if (first < bytes.size()) std::memcpy(memory_.data(), bytes.data() + first, bytes.size() - first);
  }
  void get(std::size_t place, std::span<std::byte> bytes) const noexcept {
    const std::size_t at = place % memory_.size(), first = std::min(bytes.size(), memory_.size() - at);
    if (first > 0) std::memcpy(bytes.data(), memory_.data() + at, first);
    if (first < bytes.size()) std::memcpy(bytes.data() + first, memory_.data(), bytes.size() - first);
  }

  std::span<std::byte> memory_;
  alignas(64) std::atomic<std::size_t> pushed_{0};  // bytes, since the start
  alignas(64) std::atomic<std::size_t> popped_{0};
};

}  // namespace polygmap::recording
