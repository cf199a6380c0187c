// SPDX-License-Identifier: Apache-2.0
// Clutter of tilted tiles, which fills runs, planes and the map.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::test {

// Planes of so many pixels, each tilted and placed at random; level ones and risers as the camera sees them if `steps`.
[[nodiscard]] inline std::vector<std::uint16_t> tiled_depths(const CameraIntrinsics& k, std::int32_t width_px,
                                                             std::int32_t height_px, bool steps, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&random](double from, double to) {
    return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
  };
  std::vector<std::uint16_t> raw(static_cast<std::size_t>(k.width_px * k.height_px));
  for (std::int32_t top = 0; top < k.height_px; top += height_px) {
    for (std::int32_t left = 0; left < k.width_px; left += width_px) {
      Vec3 normal{uniform(-0.5, 0.5), uniform(-0.8, 0.8), -1.0};
      if (steps) normal = uniform(0.0, 1.0) < 0.5 ? Vec3{0.0, -0.62, -0.78} : Vec3{0.0, 0.78, -0.62};
      const auto ray = [&k](std::int32_t c, std::int32_t r) {
        return Vec3{(c - k.cx_px) / k.fx_px, (r - k.cy_px) / k.fy_px, 1.0};
      };
      const double d = uniform(0.5, 2.0) * normal.dot(ray(left + width_px / 2, top + height_px / 2));
      for (std::int32_t r = top; r < std::min(top + height_px, k.height_px); ++r) {
        for (std::int32_t c = left; c < std::min(left + width_px, k.width_px); ++c) {
          const double z_m = d / normal.dot(ray(c, r)) + uniform(-0.002, 0.002);
          if (z_m > 0.2 && z_m < 4.0) {
            raw[static_cast<std::size_t>(r * k.width_px + c)] =
                static_cast<std::uint16_t>(std::lround(z_m / k.depth_unit_m));
          }
        }
      }
    }
  }
  return raw;
}

}  // namespace polygmap::test
