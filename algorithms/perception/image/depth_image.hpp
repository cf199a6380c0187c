// SPDX-License-Identifier: Apache-2.0
// Image types of the perception stages: half resolution, fixed storage, and the rays through their pixels.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/containers/raster.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

inline constexpr std::int32_t kHalfWidth_px = kDepthWidth_px / 2;
inline constexpr std::int32_t kHalfHeight_px = kDepthHeight_px / 2;

template <typename T>
using HalfImage = Raster<T, kHalfWidth_px, kHalfHeight_px>;

enum PixelFlag : std::uint8_t {
  kPixelBody = 2,  // the robot's own body may cover it: unknown, not free
};

// Ray (x, y, 1) through the centre of half-resolution pixel (column, row). Such a pixel covers the full-resolution
// pixels 2i and 2i + 1, so its centre lies at 2i + 0.5.
struct HalfRays {
  std::array<float, kHalfWidth_px> x{};
  std::array<float, kHalfHeight_px> y{};
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  double fx_px = 1.0;
  double fy_px = 1.0;
  double cx_px = 0.0;
  double cy_px = 0.0;

  void set(const CameraIntrinsics& full) noexcept {
    width_px = full.width_px / 2;
    height_px = full.height_px / 2;
    fx_px = 0.5 * full.fx_px;
    fy_px = 0.5 * full.fy_px;
    cx_px = 0.5 * (full.cx_px - 0.5);
    cy_px = 0.5 * (full.cy_px - 0.5);
    for (std::int32_t i = 0; i < width_px; ++i) {
      x[static_cast<std::size_t>(i)] = static_cast<float>((i - cx_px) / fx_px);
    }
    for (std::int32_t j = 0; j < height_px; ++j) {
      y[static_cast<std::size_t>(j)] = static_cast<float>((j - cy_px) / fy_px);
    }
  }
  [[nodiscard]] Vec3 ray(double column, double row) const noexcept {
    return {(column - cx_px) / fx_px, (row - cy_px) / fy_px, 1.0};
  }
};

}  // namespace polygmap
