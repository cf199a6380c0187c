// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/normals.hpp"

#include <algorithm>

namespace polygmap {

// Mean of the measured pixels i - radius .. i + radius; 0 where pixel i itself is empty.
void NormalEstimation::average_along(const float* w, std::int32_t width_px, std::int32_t radius_px,
                                     Line& mean) noexcept {
  // Inverse depths in 2^-20 per metre: a running sum of integers has no rounding that depends on where it started. At
  // most 17 of them below 5 / m stay within 27 bits.
  constexpr float kUnit = 1048576.0F;
  for (std::int32_t i = 0; i < width_px; ++i)
    fixed_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(w[i] * kUnit);
  const auto at = [this](std::int32_t i) { return fixed_[static_cast<std::size_t>(i)]; };
  std::int32_t sum = 0, count = 0;
  for (std::int32_t i = 0; i < std::min(radius_px, width_px); ++i) {
    sum += at(i);
    count += at(i) > 0 ? 1 : 0;
  }
  for (std::int32_t i = 0; i < width_px; ++i) {
    if (i + radius_px < width_px) {
      sum += at(i + radius_px);
      count += at(i + radius_px) > 0 ? 1 : 0;
    }
    if (i - radius_px - 1 >= 0) {
      sum -= at(i - radius_px - 1);
      count -= at(i - radius_px - 1) > 0 ? 1 : 0;
    }
    mean[static_cast<std::size_t>(i)] =
        at(i) > 0 ? static_cast<float>(sum) / (kUnit * static_cast<float>(count)) : 0.0F;
  }
}

void NormalEstimation::estimate_row(const Params& params, const HalfRays& rays, const InverseDepthImage& smoothed,
                                    std::int32_t row, NormalImage& normals) noexcept {
  const std::int32_t width = rays.width_px, height = rays.height_px;
  const std::int32_t b = std::clamp(params.baseline_px, 1, 8);
  const std::int32_t radius = std::clamp(params.row_average_px, 0, 8);
  // At the picture's borders the difference is one-sided.
  const std::int32_t row_above = std::max(row - b, 0), row_below = std::min(row + b, height - 1);
  average_along(smoothed.row(row_above), width, radius, upper_);
  average_along(smoothed.row(row_below), width, radius, lower_);
  const float* w = smoothed.row(row);
  const float* w_up = smoothed.row(std::max(row - 1, 0));
  const float* w_down = smoothed.row(std::min(row + 1, height - 1));
  for (std::int32_t i = 0; i < width; ++i) {
    const float mean = 0.25F * (w_up[i] + 2.0F * w[i] + w_down[i]);
    middle_[static_cast<std::size_t>(i)] = w_up[i] * w_down[i] * w[i] > 0.0F ? mean : w[i];
  }
  for (std::int32_t i = 0; i < width; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto l = static_cast<std::size_t>(std::max(i - b, 0));
    const auto r = static_cast<std::size_t>(std::min(i + b, width - 1));
    left_[k] = middle_[l];
    right_[k] = middle_[r];
    left_x_[k] = rays.x[l];
    right_x_[k] = rays.x[r];
  }
  const float y = rays.y[static_cast<std::size_t>(row)];
  const float y_up = rays.y[static_cast<std::size_t>(row_above)], y_low = rays.y[static_cast<std::size_t>(row_below)];
  std::int16_t* out_x = normals.x.row(row);
  std::int16_t* out_y = normals.y.row(row);
  std::int16_t* out_z = normals.z.row(row);
  for (std::int32_t i = 0; i < width; ++i) {
    const auto k = static_cast<std::size_t>(i);
    // Empty pixels compute with a dummy depth and are cleared at the end: no branch, no infinity.
    const float dummy = w[i] * left_[k] * right_[k] * upper_[k] * lower_[k] > 0.0F ? 0.0F : 1.0F;
    // Eq. (11) at the four ends, z = 1 / w.
    const float zl = 1.0F / (left_[k] + dummy), zr = 1.0F / (right_[k] + dummy);
    const float zu = 1.0F / (upper_[k] + dummy), zd = 1.0F / (lower_[k] + dummy);
    const float ax = right_x_[k] * zr - left_x_[k] * zl, ay = y * (zr - zl), az = zr - zl;
    const float bx = rays.x[k] * (zd - zu), by = y_low * zd - y_up * zu, bz = zd - zu;
    // Eq. (12) as b x a: in the camera frame (x right, y down) that one points towards the viewer.
    const float cx = by * az - bz * ay, cy = bz * ax - bx * az, cz = bx * ay - by * ax;
    const float scale = (1.0F - dummy) * kNormalScale / math::sqrt(cx * cx + cy * cy + cz * cz + 1e-24F);
    out_x[i] = static_cast<std::int16_t>(static_cast<std::int32_t>(cx * scale));
    out_y[i] = static_cast<std::int16_t>(static_cast<std::int32_t>(cy * scale));
    out_z[i] = static_cast<std::int16_t>(static_cast<std::int32_t>(cz * scale));
  }
}

}  // namespace polygmap
