// SPDX-License-Identifier: Apache-2.0
// Hands values from one writer thread to one reader thread without a wait on either side. Every value carries the frame
// that it was published in, so that what the reader sees depends on frames and not on which thread was quicker.
#pragma once

#include <array>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace polygmap {

// Before every frame: of a value that nobody published.
inline constexpr std::int64_t kNoFrame_ns = -(std::int64_t{1} << 60);

// The reader says up to which frame it looks and gets the newest value of those. The writer may be ahead meanwhile: it
// fills the slot with the oldest value, never the one that the reader holds. Of Slots, one is held, one is being
// filled; so the newest value that the reader may look at is there as long as not more than Slots - 3 others were
// published after it. A reader that comes later finds nothing and counts that in lost(); what it holds stays whole.
// One that sees only values gone that are newer than it may look at counts that, too: there may have been one for it.
// Frames are times in ns, within +-2^60 (36 years). Both sides finish in a bounded number of steps (wait-free): whoever
// loses a slot to the other side looks at the others, at most Slots times.
template <typename T, std::size_t Slots>
class Exchange {
  static_assert(std::is_default_constructible_v<T>, "values live in an array");
  static_assert(Slots >= 3, "one is read, one is filled, one waits");
  static_assert(std::atomic<std::int64_t>::is_always_lock_free, "the exchange must not hide a lock");

 public:
  Exchange() noexcept {
    for (std::atomic<std::int64_t>& slot : states_) slot.store(nobodys(kNoFrame_ns), std::memory_order_relaxed);
    states_[front_].store(nobodys(kNoFrame_ns) | kHeld, std::memory_order_relaxed);
  }
  Exchange(const Exchange&) = delete;  // two threads hold references into it
  Exchange& operator=(const Exchange&) = delete;

  // Writer only: the slot to fill before publish(). It has some older value: fill all of it.
  [[nodiscard]] T& back() noexcept {
    if (back_ == kNone) back_ = claim_oldest();
    return slots_[back_];
  }
  // Frames strictly increase: a value per frame.
  void publish(std::int64_t frame_ns) noexcept {
    assert(frame_ns > published_ns_ && back_ != kNone);
    published_ns_ = frame_ns;
    states_[back_].store(nobodys(frame_ns), std::memory_order_release);
    back_ = kNone;
  }
  void publish(std::int64_t frame_ns, const T& value) noexcept {
    back() = value;
    publish(frame_ns);
  }

  // Reader only. Takes the newest value of the frames up to last_frame_ns; false when it is the one in front already,
  // or when it is lost; front() then stays as it was.
  [[nodiscard]] bool try_take(std::int64_t last_frame_ns) noexcept {
    if (replayed_.due) return take_replayed();
    for (std::size_t attempt = 0; attempt < Slots; ++attempt) {
      const std::uint32_t newest = find_newest(last_frame_ns);
      if (newest == kNone) break;
      std::int64_t state = states_[newest].load(std::memory_order_relaxed);
      if ((state & kFlags) != 0 || frame_of(state) > last_frame_ns) continue;  // the writer has it now
      if (!states_[newest].compare_exchange_strong(state, state | kHeld, std::memory_order_acquire,
                                                   std::memory_order_relaxed)) {
        continue;
      }
      states_[front_].store(nobodys(front_frame_ns_), std::memory_order_release);
      front_ = newest;
      front_frame_ns_ = frame_of(state);
      missed_ = false;
      return true;
    }
    missed_ = newest_overwritten_ns() > front_frame_ns_;
    if (missed_) count_lost();
    return false;
  }
  // Reader only: the last try_take() came too late.
  [[nodiscard]] bool missed() const noexcept { return missed_; }
  [[nodiscard]] const T& front() const noexcept { return slots_[front_]; }
  [[nodiscard]] std::int64_t front_frame_ns() const noexcept { return front_frame_ns_; }
  // How often the reader came too late. Saturates.
  [[nodiscard]] std::uint32_t lost() const noexcept { return lost_; }

  // Which value a reader found is an input of its frame. Who replays it, on one thread, keeps the values that were
  // published and says what the next try_take() does, wherever the writer is then: it takes the value of the frame, or
  // keeps what it holds where that is null. The value stays until then.
  [[nodiscard]] std::int64_t published_ns() const noexcept { return published_ns_; }
  [[nodiscard]] const T* find(std::int64_t frame_ns) const noexcept {
    for (std::size_t i = 0; i < Slots; ++i) {
      if (states_[i].load(std::memory_order_relaxed) == nobodys(frame_ns)) return &slots_[i];
    }
    return nullptr;
  }
  void replay_take(std::int64_t frame_ns, const T* value, bool missed) noexcept {
    replayed_ = {true, missed, frame_ns, value};
  }

 private:
  // A slot's state: four times the frame of its value, and who has it.
  static constexpr std::int64_t kHeld = 1, kFilled = 2, kFlags = 3;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kCacheLine_bytes = 64;

  static constexpr std::int64_t nobodys(std::int64_t frame_ns) noexcept { return frame_ns * 4; }
  static constexpr std::int64_t frame_of(std::int64_t state) noexcept { return (state & ~kFlags) / 4; }

  [[nodiscard]] bool take_replayed() noexcept {
    replayed_.due = false;
    missed_ = replayed_.missed;
    if (missed_) count_lost();
    if (replayed_.value == nullptr) return false;
    slots_[front_] = *replayed_.value;
    front_frame_ns_ = replayed_.frame_ns;
    return true;
  }

  // A slot that nobody has, its value in (front, last_frame_ns]; kNone when there is none.
  [[nodiscard]] std::uint32_t find_newest(std::int64_t last_frame_ns) const noexcept {
    std::uint32_t newest = kNone;
    std::int64_t newest_ns = front_frame_ns_;
    for (std::uint32_t i = 0; i < Slots; ++i) {
      const std::int64_t state = states_[i].load(std::memory_order_acquire);
      const std::int64_t frame_ns = frame_of(state);
      if ((state & kFlags) != 0 || frame_ns > last_frame_ns || frame_ns <= newest_ns) continue;
      newest = i;
      newest_ns = frame_ns;
    }
    return newest;
  }

  // The reader holds one slot at a time and, while the writer looks, takes ever newer ones: some slot is free.
  [[nodiscard]] std::uint32_t claim_oldest() noexcept {
    std::uint32_t oldest = 0;
    for (std::size_t attempt = 0; attempt < Slots + 1; ++attempt) {
      std::int64_t oldest_state = std::numeric_limits<std::int64_t>::max();
      for (std::uint32_t i = 0; i < Slots; ++i) {
        const std::int64_t state = states_[i].load(std::memory_order_acquire);
        if ((state & kHeld) != 0 || state >= oldest_state) continue;
        oldest = i;
        oldest_state = state;
      }
      if (!states_[oldest].compare_exchange_strong(oldest_state, oldest_state | kFilled, std::memory_order_acq_rel,
                                                   std::memory_order_relaxed)) {
        continue;
      }
      overwritten_ns_.store(frame_of(oldest_state), std::memory_order_release);
      break;
    }
    return oldest;
  }

  // Values are overwritten oldest first: one that was newer than front leaves none to take that is older.
  [[nodiscard]] std::int64_t newest_overwritten_ns() const noexcept {
    std::int64_t gone_ns = overwritten_ns_.load(std::memory_order_acquire);
    for (const std::atomic<std::int64_t>& slot : states_) {
      const std::int64_t state = slot.load(std::memory_order_acquire);
      if ((state & kFilled) != 0 && frame_of(state) > gone_ns) gone_ns = frame_of(state);
    }
    return gone_ns;
  }
  void count_lost() noexcept {
    if (lost_ != std::numeric_limits<std::uint32_t>::max()) ++lost_;
  }

  std::array<T, Slots> slots_{};
  alignas(kCacheLine_bytes) std::array<std::atomic<std::int64_t>, Slots> states_;
  std::atomic<std::int64_t> overwritten_ns_{kNoFrame_ns};
  // The writer's.
  alignas(kCacheLine_bytes) std::uint32_t back_ = kNone;
  std::int64_t published_ns_ = kNoFrame_ns;
  // The reader's.
  alignas(kCacheLine_bytes) std::uint32_t front_ = 0;
  std::uint32_t lost_ = 0;
  std::int64_t front_frame_ns_ = kNoFrame_ns;
  bool missed_ = false;
  struct {
    bool due = false, missed = false;
    std::int64_t frame_ns = kNoFrame_ns;
    const T* value = nullptr;
  } replayed_;
};

}  // namespace polygmap
