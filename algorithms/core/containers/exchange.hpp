// SPDX-License-Identifier: Apache-2.0
// Hands the newest value from one producer thread to one consumer thread without a wait on either side.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace polygmap {

// Triple buffer: the producer fills back() and publishes it, the consumer takes the newest published value. A value
// that nobody took is overwritten. Both sides finish in a fixed number of steps (wait-free): one atomic exchange each,
// which is a single instruction on x86 and on AArch64 from v8.1 on (Orin: v8.2).
template <typename T>
class Exchange {
  static_assert(std::is_default_constructible_v<T>, "values live in an array");
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free, "the exchange must not hide a lock");

 public:
  // Producer only: the buffer to fill before publish(). It holds some older value: fill all of it.
  [[nodiscard]] T& back() noexcept { return slots_[back_]; }
  void publish() noexcept { back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex; }
  void publish(const T& value) noexcept {
    back() = value;
    publish();
  }

  // Consumer only: false when nothing new was published since the last take; front() then stays as it was.
  [[nodiscard]] bool try_take() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0U) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  [[nodiscard]] const T& front() const noexcept { return slots_[front_]; }

 private:
  static constexpr std::uint32_t kFresh = 4U;
  static constexpr std::uint32_t kIndex = 3U;
  static constexpr std::size_t kCacheLine_bytes = 64;

  std::array<T, 3> slots_{};
  alignas(kCacheLine_bytes) std::uint32_t back_ = 0;
  alignas(kCacheLine_bytes) std::atomic<std::uint32_t> middle_{1};
  alignas(kCacheLine_bytes) std::uint32_t front_ = 2;
};

}  // namespace polygmap
