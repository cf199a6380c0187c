// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/edges.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace polygmap {

void EdgeDetection::gradient_row(const Params& params, const HalfRays& rays, const NormalImage& normals,
                                 const InverseDepthImage& smoothed, std::int32_t row) noexcept {
  const std::int32_t width = rays.width_px, height = rays.height_px;
  const std::int32_t above = std::max(row - 1, 0), below = std::min(row + 1, height - 1);
  const float *w = smoothed.row(row), *w_up = smoothed.row(above), *w_down = smoothed.row(below);
  const std::int16_t *nx = normals.x.row(row), *nx_up = normals.x.row(above), *nx_down = normals.x.row(below);
  const std::int16_t *ny = normals.y.row(row), *ny_up = normals.y.row(above), *ny_down = normals.y.row(below);
  const std::int16_t *nz = normals.z.row(row), *nz_up = normals.z.row(above), *nz_down = normals.z.row(below);
  // A jump is a second difference of w, which planes do not have: z^2 |ddw| against jump_m + jump_per_m2 z^2.
  const auto jump_m = static_cast<float>(params.jump_m / params.high);
  const auto jump_per_m2 = static_cast<float>(params.jump_per_m2 / params.high);
  constexpr float kScale = 1.0F / kNormalScale;
  row_strength_[0] = row_strength_[static_cast<std::size_t>(width - 1)] = 0.0F;
  for (std::int32_t i = 1; i < width - 1; ++i) {
    const float gxx = kScale * static_cast<float>(nx[i + 1] - nx[i - 1]);
    const float gxy = kScale * static_cast<float>(ny[i + 1] - ny[i - 1]);
    const float gxz = kScale * static_cast<float>(nz[i + 1] - nz[i - 1]);
    const float gyx = kScale * static_cast<float>(nx_down[i] - nx_up[i]);
    const float gyy = kScale * static_cast<float>(ny_down[i] - ny_up[i]);
    const float gyz = kScale * static_cast<float>(nz_down[i] - nz_up[i]);
    const float inverse_gate = 1.0F / (jump_m * w[i] * w[i] + jump_per_m2);
    const float jump_x = w[i - 1] * w[i + 1] > 0.0F ? (w[i - 1] - 2.0F * w[i] + w[i + 1]) * inverse_gate : 0.0F;
    const float jump_y = w_up[i] * w_down[i] > 0.0F ? (w_up[i] - 2.0F * w[i] + w_down[i]) * inverse_gate : 0.0F;
    const float xx = gxx * gxx + gxy * gxy + gxz * gxz + jump_x * jump_x;
    const float yy = gyx * gyx + gyy * gyy + gyz * gyz + jump_y * jump_y;
    const float xy = gxx * gyx + gxy * gyy + gxz * gyz;
    const float strength = kQuantum * math::sqrt(xx + yy);
    row_strength_[static_cast<std::size_t>(i)] = w[i] > 0.0F ? strength : 0.0F;
    // Gradient within 22.5 degrees of an axis: |gx| > 2.41 |gy| and the reverse; squared, 5.83.
    const float diagonal = xy >= 0.0F ? 1.0F : 3.0F;
    const float upright = yy > 5.83F * xx ? 2.0F : diagonal;
    row_direction_[static_cast<std::size_t>(i)] = xx > 5.83F * yy ? 0.0F : upright;
  }
  std::uint8_t* out_strength = strength_.row(row);
  std::uint8_t* out_direction = marks_.row(row);
  for (std::int32_t i = 0; i < width; ++i) {
    const float strength = row_strength_[static_cast<std::size_t>(i)];
    const float limited = strength > 255.0F ? 255.0F : strength;
    out_strength[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>(limited));
    out_direction[i] =
        static_cast<std::uint8_t>(static_cast<std::int32_t>(row_direction_[static_cast<std::size_t>(i)]));
  }
}

void EdgeDetection::suppress_row(const Params& params, const HalfRays& rays, std::int32_t row) noexcept {
  // Directions of the gradient: along the row, falling, along the column, rising.
  constexpr std::array<std::int32_t, 4> kStepX{1, 1, 0, 1};
  constexpr std::array<std::int32_t, 4> kStepY{0, 1, 1, -1};
  const auto low = static_cast<std::uint8_t>(std::min(255.0, params.low * static_cast<double>(kQuantum)));
  const auto high = static_cast<std::uint8_t>(std::min(255.0, params.high * static_cast<double>(kQuantum)));
  const std::uint8_t* strength = strength_.row(row);
  std::uint8_t* state = marks_.row(row);
  const auto at = [&](std::int32_t column, std::int32_t r) {
    return column >= 0 && column < rays.width_px && r >= 0 && r < rays.height_px ? strength_(column, r)
                                                                                 : std::uint8_t{0};
  };
  bool weak = false;
  for (std::int32_t i = 0; i < rays.width_px; ++i) {
    const std::size_t d = state[i];
    state[i] = kNone;
    if (strength[i] < low) continue;
    // Strict on one side only, so that a plateau of two keeps one pixel.
    if (strength[i] < at(i - kStepX[d], row - kStepY[d]) || strength[i] <= at(i + kStepX[d], row + kStepY[d])) continue;
    state[i] = strength[i] >= high ? kStrong : kWeak;
    weak = weak || strength[i] < high;
  }
  has_weak_[static_cast<std::size_t>(row)] = weak;
}

void EdgeDetection::grow_row(std::int32_t width_px, std::int32_t height_px, std::int32_t row, bool downwards) noexcept {
  if (!has_weak_[static_cast<std::size_t>(row)]) return;
  std::uint8_t* state = marks_.row(row);
  const std::int32_t before = downwards ? row - 1 : row + 1;
  const std::uint8_t* previous = before >= 0 && before < height_px ? marks_.row(before) : nullptr;
  const auto touches = [&](std::int32_t i) {
    if (i > 0 && state[i - 1] == kStrong) return true;
    if (i + 1 < width_px && state[i + 1] == kStrong) return true;
    if (previous == nullptr) return false;
    for (std::int32_t c = std::max(i - 1, 0); c <= std::min(i + 1, width_px - 1); ++c) {
      if (previous[c] == kStrong) return true;
    }
    return false;
  };
  // Weak pixels are rare: eight are passed over at once. Their states are 0, 1, 2, and only 1 has the low bit.
  constexpr std::int32_t kBlock = 8;
  static_assert(static_cast<int>(kWeak) == 1 && kHalfWidth_px % kBlock == 0);
  const auto any_weak = [&](std::int32_t i) {
    std::uint64_t word = 0;
    std::memcpy(&word, state + i, sizeof(word));
    return (word & 0x0101010101010101U) != 0;
  };
  for (std::int32_t block = 0; block < width_px; block += kBlock) {
    if (!any_weak(block)) continue;
    for (std::int32_t i = block; i < std::min(block + kBlock, width_px); ++i) {
      if (state[i] == kWeak && touches(i)) state[i] = kStrong;
    }
  }
  for (std::int32_t block = (width_px - 1) / kBlock * kBlock; block >= 0; block -= kBlock) {
    if (!any_weak(block)) continue;
    for (std::int32_t i = std::min(block + kBlock, width_px) - 1; i >= block; --i) {
      if (state[i] == kWeak && touches(i)) state[i] = kStrong;
    }
  }
}

}  // namespace polygmap
