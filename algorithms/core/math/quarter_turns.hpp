// SPDX-License-Identifier: Apache-2.0
// Reduction of large angles: which quarter turn an angle is nearest to, and what is left of it.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace polygmap::math {

struct QuarterTurns {
  double rest_rad;        // within +-pi/4
  std::uint64_t quarter;  // modulo 4
};

// Of finite angles of 2^15 rad and more, up to the largest number. Source: Payne and Hanek, "Radian reduction for
// trigonometric functions", 1983: of 2/pi only those bits are multiplied that decide the quarter and the rest.
[[nodiscard, gnu::cold, gnu::noinline]] inline QuarterTurns quarter_turns_of_large(double x_rad) noexcept {
  // 2/pi behind 64 zeros.
  static constexpr std::array<std::uint64_t, 20> kTwoByPi = {
      0x0000000000000000U, 0xA2F9836E4E441529U, 0xFC2757D1F534DDC0U, 0xDB6295993C439041U, 0xFE5163ABDEBBC561U,
      0xB7246E3A424DD2E0U, 0x06492EEA09D1921CU, 0xFE1DEB1CB129A73EU, 0xE88235F52EBB4484U, 0xE99C7026B45F7E41U,
      0x3991D639835339F4U, 0x9C845F8BBDF9283BU, 0x1FF897FFDE05980FU, 0xEF2F118B5A0A6D1FU, 0x6D367ECF27CB09B7U,
      0x4F463F669E5FEA2DU, 0x7527BAC7EBE5F17BU, 0x3D0739F78A5292EAU, 0x6BFB5FB11F8D5D08U, 0x56033046FC7B6BABU};
  using Wide = unsigned __int128;
  const auto bits = std::bit_cast<std::uint64_t>(x_rad);
  const std::uint64_t mantissa = (bits & 0xFFFFFFFFFFFFFU) | 0x10000000000000U;
  // |x| is mantissa * 2^exponent. Bits of 2/pi above 2^(2 - exponent) give whole turns: they are left out.
  const auto exponent = static_cast<std::int32_t>(bits >> 52 & 0x7FFU) - 1075;
  const auto first = static_cast<std::uint32_t>(exponent + 62);
  const auto word = [first](std::uint32_t n) noexcept {
    const std::uint32_t i = first / 64 + n, shift = first % 64;
    return shift == 0 ? kTwoByPi[i] : kTwoByPi[i] << shift | kTwoByPi[i + 1] >> (64 - shift);
  };
  // The lowest 128 of 192 bits of the product's fraction of a turn, highest first.
  const Wide low = Wide{mantissa} * word(2);
  const Wide middle = Wide{mantissa} * word(1) + static_cast<std::uint64_t>(low >> 64U);
  const std::uint64_t high = mantissa * word(0) + static_cast<std::uint64_t>(middle >> 64U);
  const std::uint64_t quarter = ((high >> 61U) + 1U) >> 1U;
  Wide rest = Wide{high - (quarter << 62U)} << 64U | static_cast<std::uint64_t>(middle);
  const bool below = (rest >> 127U) != 0;
  if (below) rest = ~rest + 1U;
  if (rest == 0) return {0.0, quarter};  // no double is that near to a multiple
  const auto top = static_cast<std::uint64_t>(rest >> 64U);
  const int zeros = top != 0 ? std::countl_zero(top) : 64 + std::countl_zero(static_cast<std::uint64_t>(rest));
  const auto leading =
      static_cast<std::int64_t>(static_cast<std::uint64_t>((rest << static_cast<unsigned>(zeros)) >> 65U));
  // leading * 2^(-61 - zeros) quarters of a turn
  const double scale = std::bit_cast<double>(static_cast<std::uint64_t>(1023 - 61 - zeros) << 52U);
  const double rest_rad = static_cast<double>(leading) * scale * 1.57079632679489661923;
  const bool negative = (bits >> 63U) != 0;
  return {below != negative ? -rest_rad : rest_rad, negative ? 0U - quarter : quarter};
}

}  // namespace polygmap::math
