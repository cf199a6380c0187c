// SPDX-License-Identifier: Apache-2.0
// Eq. (11) as printed. The module never forms points: inverse depth is linear in the picture on a plane
// (column_image.hpp).
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

// Eq. (11); u, v in pixels of the picture that the intrinsics belong to, depth along the optical axis.
[[nodiscard]] inline Vec3 back_project(const CameraIntrinsics& k, double u_px, double v_px, double depth_m) noexcept {
  return {(u_px - k.cx_px) * depth_m / k.fx_px, (v_px - k.cy_px) * depth_m / k.fy_px, depth_m};
}

}  // namespace polygmap
