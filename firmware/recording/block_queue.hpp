// SPDX-License-Identifier: Apache-2.0
// Blocks of bytes from one thread to one other, in memory that somebody else owns: written and read where they lie.
// Nobody waits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace polygmap::recording {

class BlockQueue {
 public:
  // memory: a multiple of 8 bytes.
  explicit BlockQueue(std::span<std::byte> memory) noexcept : memory_(memory) {}

  // On the writer's thread: memory for a block of at most so many bytes, in one piece; empty when there is no room.
  // Nobody sees it before commit().
  [[nodiscard]] std::span<std::byte> reserve(std::size_t most) noexcept {
    const std::size_t begin = pushed_.load(std::memory_order_relaxed), at = begin % memory_.size();
    const std::size_t free = memory_.size() - (begin - popped_.load(std::memory_order_acquire));
    const std::size_t to_end = memory_.size() - at, needed = kHead_bytes + most;
    reserved_ = begin;
    if (needed <= to_end) return needed <= free ? memory_.subspan(at + kHead_bytes, most) : std::span<std::byte>();
    if (to_end + needed > free) return {};
    put_length(at, kGoesOnAtTheBeginning);
    reserved_ = begin + to_end;
    return memory_.subspan(kHead_bytes, most);
  }
  // The first bytes of what was reserved are a block.
  void commit(std::size_t count) noexcept {
    put_length(reserved_ % memory_.size(), static_cast<std::uint32_t>(count));
    pushed_.store(reserved_ + size_of(count), std::memory_order_release);
  }

  // On the reader's thread: the oldest block, its own until pop(); empty when there is none.
  [[nodiscard]] std::span<std::byte> front() noexcept {
    std::size_t begin = popped_.load(std::memory_order_relaxed);
    if (pushed_.load(std::memory_order_acquire) == begin) return {};
    if (length_at(begin % memory_.size()) == kGoesOnAtTheBeginning) {
      begin += memory_.size() - begin % memory_.size();
      popped_.store(begin, std::memory_order_release);
    }
    const std::size_t at = begin % memory_.size();
    return memory_.subspan(at + kHead_bytes, length_at(at));
  }
  void pop() noexcept {
    const std::size_t begin = popped_.load(std::memory_order_relaxed);
    popped_.store(begin + size_of(length_at(begin % memory_.size())), std::memory_order_release);
  }

 private:
  static constexpr std::size_t kHead_bytes = 8;  // its length, and what keeps blocks aligned
  static constexpr std::uint32_t kGoesOnAtTheBeginning = UINT32_MAX;

  [[nodiscard]] static std::size_t size_of(std::size_t count) noexcept { return (kHead_bytes + count + 7U) / 8U * 8U; }
  void put_length(std::size_t at, std::uint32_t length) noexcept {
    std::memcpy(memory_.data() + at, &length, sizeof length);
  }
  [[nodiscard]] std::uint32_t length_at(std::size_t at) const noexcept {
    std::uint32_t length = 0;
    std::memcpy(&length, memory_.data() + at, sizeof length);
    return length;
  }

  std::span<std::byte> memory_;
  std::size_t reserved_ = 0;                        // the writer's
  alignas(64) std::atomic<std::size_t> pushed_{0};  // bytes, since the start
  alignas(64) std::atomic<std::size_t> popped_{0};
};

}  // namespace polygmap::recording
