// SPDX-License-Identifier: Apache-2.0
// A dense grid of fixed capacity: images (row 0 at the top) and foothold rasters alike.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace polygmap {

// Width x Height cells of T, row-major, no padding.
template <typename T, std::int32_t Width, std::int32_t Height>
class Raster {
  static_assert(Width > 0 && Height > 0, "a raster without cells is a mistake");
  static_assert(std::is_trivially_copyable_v<T>, "cells are plain values");

 public:
  using value_type = T;
  [[nodiscard]] static constexpr std::int32_t width() noexcept { return Width; }
  [[nodiscard]] static constexpr std::int32_t height() noexcept { return Height; }
  [[nodiscard]] static constexpr std::size_t size() noexcept { return static_cast<std::size_t>(Width) * Height; }

  [[nodiscard]] static constexpr bool contains(std::int32_t column, std::int32_t row) noexcept {
    return column >= 0 && column < Width && row >= 0 && row < Height;
  }
  [[nodiscard]] constexpr T& operator()(std::int32_t column, std::int32_t row) noexcept {
    assert(contains(column, row));
    return data_[index(column, row)];
  }
  [[nodiscard]] constexpr const T& operator()(std::int32_t column, std::int32_t row) const noexcept {
    assert(contains(column, row));
    return data_[index(column, row)];
  }
  // False, and out untouched, outside the grid.
  [[nodiscard]] constexpr bool try_get(std::int32_t column, std::int32_t row, T& out) const noexcept {
    if (!contains(column, row)) return false;
    out = data_[index(column, row)];
    return true;
  }
  [[nodiscard]] constexpr T* row(std::int32_t r) noexcept {
    assert(contains(0, r));
    return data_.data() + index(0, r);
  }
  [[nodiscard]] constexpr const T* row(std::int32_t r) const noexcept {
    assert(contains(0, r));
    return data_.data() + index(0, r);
  }
  [[nodiscard]] constexpr T* data() noexcept { return data_.data(); }
  [[nodiscard]] constexpr const T* data() const noexcept { return data_.data(); }
  constexpr void fill(const T& value) noexcept { data_.fill(value); }

 private:
  [[nodiscard]] static constexpr std::size_t index(std::int32_t column, std::int32_t r) noexcept {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(Width) + static_cast<std::size_t>(column);
  }
  std::array<T, static_cast<std::size_t>(Width) * Height> data_{};
};

}  // namespace polygmap
