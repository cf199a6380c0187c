// SPDX-License-Identifier: Apache-2.0
// What a way to quantise must do, checked while compiling: the module's, and in toolchain/checks/seeded/codec one that
// truncates.
#pragma once

#include <cstdint>

namespace polygmap::codec_properties {

// quantise(x, least, most, bits) gives the nearest of 2^bits - 1 equal steps, and the ends for what is outside.
template <class Quantise>
[[nodiscard]] constexpr bool rounds_to_nearest(Quantise quantise, double least, double most, unsigned bits) {
  const std::uint32_t steps = (1U << bits) - 1U;
  for (std::uint32_t step = 0; step <= steps; step += 1U + steps / 97U) {
    for (const double off : {-0.49, 0.0, 0.49}) {
      const double x = least + (most - least) * (step + off) / steps;
      if (x < least || x > most) continue;
      if (quantise(x, least, most, bits) != step) return false;
    }
  }
  return quantise(least - 1.0, least, most, bits) == 0U && quantise(most + 1.0, least, most, bits) == steps;
}

}  // namespace polygmap::codec_properties
