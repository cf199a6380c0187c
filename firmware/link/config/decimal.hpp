// SPDX-License-Identifier: Apache-2.0
// Decimal numbers to binary ones, correctly rounded, and back: the C library's depend on its locale, the C++ library's
// on the heap, and neither is the module's to link.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/link/config/fixed_text.hpp"

namespace polygmap::link {

// digits * 10^exponent. As many digits and such exponents are all that a parameter takes.
struct Decimal {
  static constexpr int kMostDigits = 19, kLeastExponent = -37, kMostExponent = 19;
  std::uint64_t digits = 0;
  int exponent = 0;
};

namespace detail {

__extension__ using Wide = unsigned __int128;

[[nodiscard]] constexpr Wide ten_to_the(int exponent) noexcept {
  Wide power = 1;
  for (int i = 0; i < exponent; ++i) power *= 10;
  return power;
}

// The nearest double of whole + rest / of, ties to even; rest < of < 2^124.
[[nodiscard]] constexpr double nearest(Wide whole, Wide rest, Wide of) noexcept {
  constexpr int kMantissa_bits = 53;
  Wide bits = whole;
  int exponent = 0;
  while (bits < (Wide{1} << (kMantissa_bits + 1)) && (bits != 0 || rest != 0)) {
    rest <<= 1U;
    bits <<= 1U;
    if (rest >= of) {
      rest -= of;
      bits |= 1U;
    }
    --exponent;
  }
  bool beyond = rest != 0;  // of what was cut off
  while (bits >= (Wide{1} << (kMantissa_bits + 1))) {
    beyond = beyond || (bits & 1U) != 0;
    bits >>= 1U;
    ++exponent;
  }
  const bool more_than_half = (bits & 1U) != 0 && (beyond || (bits & 2U) != 0);
  auto value = static_cast<double>(static_cast<std::uint64_t>(bits >> 1U) + (more_than_half ? 1U : 0U));
  for (++exponent; exponent > 0; --exponent) value *= 2.0;
  for (; exponent < 0; ++exponent) value *= 0.5;
  return value;
}

}  // namespace detail

[[nodiscard]] constexpr double to_double(const Decimal& decimal) noexcept {
  if (decimal.exponent >= 0) return detail::nearest(decimal.digits * detail::ten_to_the(decimal.exponent), 0, 1);
  const detail::Wide of = detail::ten_to_the(-decimal.exponent);
  if (of > decimal.digits) return detail::nearest(0, decimal.digits, of);
  const auto short_of = static_cast<std::uint64_t>(of);
  return detail::nearest(decimal.digits / short_of, decimal.digits % short_of, of);
}

// In the fewest decimals that are the number to 12 digits; for bounds of parameters, whose digits are few.
template <std::size_t Capacity>
constexpr void append(FixedText<Capacity>& text, double number) noexcept {
  constexpr int kMostDecimals = 12;
  constexpr double kMost = 1e15;
  if (number < 0.0) text.append("-");
  const double size = std::min(number < 0.0 ? -number : number, kMost);
  double scale = 1.0;
  int decimals = 0;
  const auto scaled = [&] { return static_cast<std::uint64_t>(size * scale + 0.5); };
  const auto is_enough = [&] {
    const double off = static_cast<double>(scaled()) / scale - size;
    return size == 0.0 || (scaled() > 0 && (off < 0.0 ? -off : off) <= 1e-12 * size);
  };
  while (decimals < kMostDecimals && size * scale < 1e12 && !is_enough()) {
    ++decimals;
    scale *= 10.0;
  }
  std::array<char, 32> reversed{};
  std::size_t count = 0;
  std::uint64_t digits = scaled();
  for (int place = 0; digits > 0 || place <= decimals; ++place, digits /= 10) {
    if (place > 0 && place == decimals) reversed[count++] = '.';
    reversed[count++] = static_cast<char>('0' + digits % 10);
  }
  while (count > 0) text.append({&reversed[--count], 1});
}

}  // namespace polygmap::link
