// SPDX-License-Identifier: Apache-2.0
// Column images of a few planes, exact or noisy, for the tests of the stages that work on them.
#pragma once

#include <functional>
#include <memory>
#include <random>

#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"

namespace polygmap::test {

struct ColumnScene {
  CameraIntrinsics intrinsics{};
  ColumnRays rays;
  std::unique_ptr<ColumnImage> image = std::make_unique<ColumnImage>();

  ColumnScene() {
    intrinsics.width_px = kDepthWidth_px;
    intrinsics.height_px = kDepthHeight_px;
    intrinsics.fx_px = intrinsics.fy_px = 400.0;
    intrinsics.cx_px = 320.0;
    intrinsics.cy_px = 240.0;
    intrinsics.depth_unit_m = 0.001;
    rays.set(intrinsics);
  }
  [[nodiscard]] Vec3 ray(std::int32_t column, std::int32_t row) const {
    return {static_cast<double>(rays.x[static_cast<std::size_t>(column)]),
            static_cast<double>(rays.y[static_cast<std::size_t>(row)]), 1.0};
  }
  // plane_of(column, row): the plane seen there, null = nothing.
  void paint(const std::function<const InversePlane*(std::int32_t, std::int32_t)>& plane_of, double sigma_m = 0.0,
             std::uint32_t seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (std::int32_t r = 0; r < kDepthHeight_px; ++r) {
      for (std::int32_t g = 0; g < kColumns; ++g) {
        const InversePlane* plane = plane_of(g, r);
        const double w = plane == nullptr ? 0.0 : plane->inverse_depth(ray(g, r));
        const double z = w > 0.0 ? 1.0 / w + sigma_m * noise(random) : 0.0;
        image->inverse_depth(g, r) = z > 0.0 ? static_cast<float>(1.0 / z) : 0.0F;
        image->valid(g, r) = z > 0.0 ? std::uint8_t{kColumn_px} : std::uint8_t{0};
      }
    }
    image->transpose(0, kDepthHeight_px - 1);
  }
};

// Normal towards the camera, distance from it.
[[nodiscard]] inline InversePlane plane_of(const Vec3& normal, double d_m) { return {-normal.normalized() / d_m}; }

}  // namespace polygmap::test
