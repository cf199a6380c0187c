// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace polygmap::daemon {

// A line of text of fixed capacity; what does not fit is cut. Allocates nothing.
struct StatusText {
  std::array<char, 1000> text{};
  std::size_t length = 0;

  [[gnu::format(printf, 2, 3)]] void add(const char* format, ...) noexcept;
  [[nodiscard]] std::string_view view() const noexcept { return {text.data(), length}; }
};

}  // namespace polygmap::daemon
