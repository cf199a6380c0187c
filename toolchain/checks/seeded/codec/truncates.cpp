// SPDX-License-Identifier: Apache-2.0
// expect: static assertion failed: it rounds
#include "tests/support/codec_properties.hpp"

namespace {

// As many published drivers do it.
constexpr std::uint32_t truncated(double x, double least, double most, unsigned bits) {
  const std::uint32_t steps = (1U << bits) - 1U;
  if (x <= least) return 0U;
  if (x >= most) return steps;
  return static_cast<std::uint32_t>((x - least) / (most - least) * steps);
}
static_assert(polygmap::codec_properties::rounds_to_nearest(truncated, -12.5, 12.5, 12), "it rounds");

}  // namespace
