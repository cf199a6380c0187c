// SPDX-License-Identifier: Apache-2.0
// The last Capacity values, oldest first. Single thread; the Exchange crosses threads.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <type_traits>

namespace polygmap {

template <typename T, std::size_t Capacity>
class RingBuffer {
  static_assert(Capacity > 0, "a container without room is a mistake");
  // Not the nothrow traits: fixed-size Eigen members never throw but do not say so.
  static_assert(std::is_default_constructible_v<T> && std::is_copy_assignable_v<T>,
                "elements live in an array: they need a default constructor and copy");
  static_assert(std::is_trivially_destructible_v<T>, "elements are overwritten, never destroyed one by one");

 public:
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return Capacity; }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] constexpr bool full() const noexcept { return size_ == Capacity; }

  // Appends; when full the oldest value makes room.
  constexpr void push_overwrite(const T& value) noexcept {
    data_[(head_ + size_) % Capacity] = value;
    if (full()) {
      head_ = (head_ + 1) % Capacity;
    } else {
      ++size_;
    }
  }
  // Needs one to replace.
  constexpr void replace_newest(const T& value) noexcept {
    assert(size_ > 0);
    data_[(head_ + size_ - 1) % Capacity] = value;
  }
  // False, and no change, when full.
  [[nodiscard]] constexpr bool try_push(const T& value) noexcept {
    if (full()) return false;
    push_overwrite(value);
    return true;
  }
  // Takes the oldest value out. False, and out untouched, when empty.
  [[nodiscard]] constexpr bool try_pop(T& out) noexcept {
    if (empty()) return false;
    out = data_[head_];
    head_ = (head_ + 1) % Capacity;
    --size_;
    return true;
  }
  constexpr void clear() noexcept { head_ = size_ = 0; }

  // 0 is the oldest.
  [[nodiscard]] constexpr const T& operator[](std::size_t i) const noexcept {
    assert(i < size_);
    return data_[(head_ + i) % Capacity];
  }
  [[nodiscard]] constexpr const T& oldest() const noexcept { return (*this)[0]; }
  [[nodiscard]] constexpr const T& newest() const noexcept { return (*this)[size_ - 1]; }

 private:
  std::array<T, Capacity> data_{};
  std::size_t head_ = 0;
  std::size_t size_ = 0;
};

}  // namespace polygmap
