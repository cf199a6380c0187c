// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/depth_reduction.hpp"

#include <algorithm>

namespace polygmap {

void DepthReduction::set(const Params& params, double depth_unit_m) noexcept {
  unit_m_ = static_cast<float>(depth_unit_m);
  range_.set(params.limits, depth_unit_m);
  jump_raw_ = static_cast<float>(params.jump_m / depth_unit_m);
  jump_per_raw2_ = static_cast<float>(params.jump_per_m2 * depth_unit_m);
}

void DepthReduction::reduce_row(const std::uint16_t* upper, const std::uint16_t* lower, std::int32_t half_width_px,
                                float* inverse_depth, std::uint8_t* flags) const noexcept {
  constexpr float kInvalid = 1e6F;  // sorts to the end
  Cells cells;
  for (std::int32_t i = 0; i < half_width_px; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto value = [this](std::uint16_t raw) { return range_.valid(raw) ? static_cast<float>(raw) : kInvalid; };
    cells[0][k] = value(upper[2 * i]);
    cells[1][k] = value(upper[2 * i + 1]);
    cells[2][k] = value(lower[2 * i]);
    cells[3][k] = value(lower[2 * i + 1]);
  }
  const auto lesser = [](float a, float b) { return a < b ? a : b; };
  const auto greater = [](float a, float b) { return a < b ? b : a; };
  for (std::int32_t i = 0; i < half_width_px; ++i) {
    const auto k = static_cast<std::size_t>(i);
    // Sorted: z0 <= z1 <= z2 <= z3.
    const float p = lesser(cells[0][k], cells[1][k]), q = greater(cells[0][k], cells[1][k]);
    const float r = lesser(cells[2][k], cells[3][k]), t = greater(cells[2][k], cells[3][k]);
    const float z0 = lesser(p, r), z3 = greater(q, t);
    const float u = greater(p, r), v = lesser(q, t);
    const float z1 = lesser(u, v), z2 = greater(u, v);
    // The middle pair: (z1, z2) of four, (z1, z1) of three, (z0, z1) of two, (z0, z0) of one.
    const float near = z2 < kInvalid ? z1 : z0;
    const float two_or_three = z1 < kInvalid ? z1 : z0;
    const float far = z3 < kInvalid ? z2 : two_or_three;
    // Across a jump: the two nearest of four if they agree, else the nearest alone.
    const float jump = jump_raw_ + jump_per_raw2_ * z0 * z0;
    const float second = z3 < kInvalid ? z1 : far;
    const float agreed = second - z0 > jump ? z0 : second;
    const float sum = far - near > jump ? z0 + agreed : near + far;
    inverse_depth[i] = z0 < kInvalid ? 2.0F / (sum * unit_m_) : 0.0F;
  }
  for (std::int32_t i = 0; i < half_width_px; ++i) {
    flags[i] = inverse_depth[i] > 0.0F ? std::uint8_t{kPixelMeasured} : std::uint8_t{0};
  }
}

void fill_holes_row(const InverseDepthImage& measured, const HalfImage<std::uint8_t>& flags, std::int32_t row,
                    std::int32_t width_px, std::int32_t height_px, float* filled) noexcept {
  constexpr std::int32_t kRadius_px = 2;
  constexpr std::int32_t kLeastNeighbours = 6;
  const float* source = measured.row(row);
  const std::uint8_t* flag = flags.row(row);
  std::copy(source, source + width_px, filled);
  const std::int32_t first_row = std::max(row - kRadius_px, 0), last_row = std::min(row + kRadius_px, height_px - 1);
  for (std::int32_t i = 0; i < width_px; ++i) {
    if (source[i] > 0.0F || (flag[i] & kPixelBody) != 0) continue;
    float sum = 0.0F;
    std::int32_t count = 0;
    for (std::int32_t r = first_row; r <= last_row; ++r) {
      const float* line = measured.row(r);
      for (std::int32_t c = std::max(i - kRadius_px, 0); c <= std::min(i + kRadius_px, width_px - 1); ++c) {
        sum += line[c];
        count += line[c] > 0.0F ? 1 : 0;
      }
    }
    if (count >= kLeastNeighbours) filled[i] = sum / static_cast<float>(count);
  }
}

}  // namespace polygmap
