// SPDX-License-Identifier: Apache-2.0
// A vector whose storage is part of the object. Full is an answer, not an error.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <type_traits>

namespace polygmap {

// At most Capacity elements of a trivially copyable or fixed-size value type T. All operations are O(1) and noexcept
// except resize and the copy (O(Capacity)). Elements beyond size() keep their last value.
template <typename T, std::size_t Capacity>
class StaticVector {
  static_assert(Capacity > 0, "a container without room is a mistake");
  // Not the nothrow traits: fixed-size Eigen members never throw but do not say so.
  static_assert(std::is_default_constructible_v<T> && std::is_copy_assignable_v<T>,
                "elements live in an array: they need a default constructor and copy");
  static_assert(std::is_trivially_destructible_v<T>, "elements are overwritten, never destroyed one by one");

 public:
  using value_type = T;
  using iterator = T*;
  using const_iterator = const T*;

  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return Capacity; }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] constexpr bool full() const noexcept { return size_ == Capacity; }

  // False, and no change, when full.
  [[nodiscard]] constexpr bool try_push_back(const T& value) noexcept {
    if (full()) return false;
    data_[size_++] = value;
    return true;
  }
  // False, and no change, when empty.
  [[nodiscard]] constexpr bool try_pop_back() noexcept {
    if (empty()) return false;
    --size_;
    return true;
  }
  // False, and no change, when count exceeds the capacity. New elements are T{} (Eigen: unset).
  [[nodiscard]] constexpr bool try_resize(std::size_t count) noexcept {
    if (count > Capacity) return false;
    for (std::size_t i = size_; i < count; ++i) data_[i] = T{};
    size_ = count;
    return true;
  }
  // Removes element i by moving the last one into its place; order is lost. False when i is out of range.
  [[nodiscard]] constexpr bool try_swap_remove(std::size_t i) noexcept {
    if (i >= size_) return false;
    data_[i] = data_[--size_];
    return true;
  }
  constexpr void clear() noexcept { size_ = 0; }

  [[nodiscard]] constexpr T& operator[](std::size_t i) noexcept {
    assert(i < size_);
    return data_[i];
  }
  [[nodiscard]] constexpr const T& operator[](std::size_t i) const noexcept {
    assert(i < size_);
    return data_[i];
  }
  [[nodiscard]] constexpr T& back() noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] constexpr const T& back() const noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] constexpr T& front() noexcept { return (*this)[0]; }
  [[nodiscard]] constexpr const T& front() const noexcept { return (*this)[0]; }

  [[nodiscard]] constexpr iterator begin() noexcept { return data_.data(); }
  [[nodiscard]] constexpr iterator end() noexcept { return data_.data() + size_; }
  [[nodiscard]] constexpr const_iterator begin() const noexcept { return data_.data(); }
  [[nodiscard]] constexpr const_iterator end() const noexcept { return data_.data() + size_; }

 private:
  std::array<T, Capacity> data_{};
  std::size_t size_ = 0;
};

}  // namespace polygmap
