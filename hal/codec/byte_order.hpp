// SPDX-License-Identifier: Apache-2.0
// Numbers in little-endian bytes, whatever the machine's own order.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace polygmap::codec {

using Bytes = std::span<const std::uint8_t>;
using WritableBytes = std::span<std::uint8_t>;

// The unsigned number in the sizeof(T) bytes from at on, which must be there.
template <typename T>
[[nodiscard]] constexpr T load_le(Bytes bytes, std::size_t at) noexcept {
  std::uint64_t value = 0;
  for (std::size_t i = sizeof(T); i-- > 0;) value = (value << 8) | bytes[at + i];
  return static_cast<T>(value);
}
template <typename T>
constexpr void store_le(WritableBytes bytes, std::size_t at, T value) noexcept {
  std::uint64_t rest = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i, rest >>= 8) bytes[at + i] = static_cast<std::uint8_t>(rest & 0xFF);
}

// IEEE 754.
[[nodiscard]] constexpr double load_f64(Bytes bytes, std::size_t at) noexcept {
  return std::bit_cast<double>(load_le<std::uint64_t>(bytes, at));
}
[[nodiscard]] constexpr float load_f32(Bytes bytes, std::size_t at) noexcept {
  return std::bit_cast<float>(load_le<std::uint32_t>(bytes, at));
}
constexpr void store_f64(WritableBytes bytes, std::size_t at, double value) noexcept {
  store_le(bytes, at, std::bit_cast<std::uint64_t>(value));
}
constexpr void store_f32(WritableBytes bytes, std::size_t at, float value) noexcept {
  store_le(bytes, at, std::bit_cast<std::uint32_t>(value));
}

// |x| <= limit; false for NaN, while std::isfinite is no constant expression.
[[nodiscard]] constexpr bool within(double x, double limit) noexcept { return x >= -limit && x <= limit; }

}  // namespace polygmap::codec
