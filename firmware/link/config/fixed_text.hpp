// SPDX-License-Identifier: Apache-2.0
// Text whose storage is part of the object. What does not fit is cut off.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

namespace polygmap::link {

// From the byte `begin` on, as far as there is text: std::string_view::substr() can throw.
[[nodiscard]] constexpr std::string_view part(std::string_view text, std::size_t begin,
                                              std::size_t count = std::string_view::npos) noexcept {
  begin = std::min(begin, text.size());
  return {text.data() + begin, std::min(count, text.size() - begin)};
}

template <std::size_t Capacity>
class FixedText {
 public:
  constexpr void clear() noexcept { resize(0); }
  constexpr void append(std::string_view more) noexcept {
    const std::size_t count = std::min(more.size(), Capacity - size_);
    std::copy_n(more.data(), count, data_.begin() + static_cast<std::ptrdiff_t>(size_));
    resize(size_ + count);
  }
  // What was appended since is gone.
  constexpr void resize(std::size_t size) noexcept {
    size_ = size;
    data_[size_] = '\0';
  }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr std::string_view view() const noexcept { return {data_.data(), size_}; }
  [[nodiscard]] constexpr const char* c_str() const noexcept { return data_.data(); }

 private:
  std::array<char, Capacity + 1> data_{};
  std::size_t size_ = 0;
};

}  // namespace polygmap::link
