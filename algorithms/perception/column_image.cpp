// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/column_image.hpp"

namespace polygmap {

void reduce_to_columns(const RawRange& range, const std::uint16_t* raw, const std::uint8_t* body, std::int32_t columns,
                       float* inverse_depth, std::uint8_t* valid) noexcept {
  std::array<float, kDepthWidth_px> each;
  const std::int32_t lowest = range.min, highest = range.max;
  for (std::int32_t i = 0; i < columns * kColumn_px; ++i) {
    const std::int32_t d = raw[i];
    const bool good = d >= lowest && d <= highest;
    each[static_cast<std::size_t>(i)] = good ? range.per_metre / static_cast<float>(good ? d : 1) : 0.0F;
  }
  for (std::int32_t g = 0; g < columns; ++g) {
    const float* p = each.data() + static_cast<std::ptrdiff_t>(kColumn_px) * g;
    const std::int32_t n =
        (p[0] > 0.0F ? 1 : 0) + (p[1] > 0.0F ? 1 : 0) + (p[2] > 0.0F ? 1 : 0) + (p[3] > 0.0F ? 1 : 0);
    const float sum = (p[0] + p[1]) + (p[2] + p[3]);
    inverse_depth[g] = n > 0 ? sum / static_cast<float>(n > 0 ? n : 1) : 0.0F;
    valid[g] = static_cast<std::uint8_t>(n);
  }
  if (body == nullptr) return;
  for (std::int32_t g = 0; g < columns; ++g) {
    if (((body[2 * g] | body[2 * g + 1]) & kPixelBody) == 0) continue;
    inverse_depth[g] = 0.0F;
    valid[g] = 0;
  }
}

}  // namespace polygmap
