// SPDX-License-Identifier: Apache-2.0
// Surface normals from smoothed inverse depth, eqs (11) and (12).
#pragma once

#include <array>
#include <cstdint>

#include "tests/reference/paper_route/half_depth.hpp"

namespace polygmap {

// Unit normal times kNormalScale, towards the camera, one image per component; all zero where there is none.
inline constexpr float kNormalScale = 32000.0F;
struct NormalImage {
  HalfImage<std::int16_t> x;
  HalfImage<std::int16_t> y;
  HalfImage<std::int16_t> z;
};

// Eq. (12) with central differences over a baseline instead of neighbouring pixels: at 0.8 m neighbours are 4 mm apart
// and the noise is 2 mm, so the paper's forward difference is all noise. Each end of a difference is a mean across it.
class NormalEstimation {
 public:
  struct Params {
    std::int32_t baseline_px = 3;     // half-resolution pixels to each side
    std::int32_t row_average_px = 3;  // pixels to each side averaged along the row, for the vertical difference
  };

  void estimate_row(const Params& params, const HalfRays& rays, const InverseDepthImage& smoothed, std::int32_t row,
                    NormalImage& normals) noexcept;

 private:
  using Line = std::array<float, kHalfWidth_px>;
  void average_along(const float* w, std::int32_t width_px, std::int32_t radius_px, Line& mean) noexcept;

  std::array<std::int32_t, kHalfWidth_px> fixed_{};
  Line upper_{};
  Line lower_{};
  Line middle_{};
  Line left_{};  // middle_, baseline pixels to the left
  Line right_{};
  Line left_x_{};  // and the rays there
  Line right_x_{};
};

}  // namespace polygmap
