// SPDX-License-Identifier: Apache-2.0
// Random draws without a state.
#pragma once

#include <cstdint>

namespace polygmap {

// A 32-bit hash of a counter: the same draws on every machine and in every slicing.
[[nodiscard]] constexpr std::uint32_t counter_random(std::uint32_t seed, std::uint32_t counter) noexcept {
  std::uint32_t h = seed * 0x9E3779B9U + counter * 0x85EBCA6BU + 0x27220A95U;
  h ^= h >> 16U;
  h *= 0x7FEB352DU;
  h ^= h >> 15U;
  h *= 0x846CA68BU;
  h ^= h >> 16U;
  return h;
}

}  // namespace polygmap
