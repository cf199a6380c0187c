// SPDX-License-Identifier: Apache-2.0
// Edges in the Canny manner: gradient, non-maximum suppression, hysteresis.
#pragma once

#include <cstdint>

#include "tests/reference/paper_route/half_depth.hpp"
#include "tests/reference/paper_route/normals.hpp"

namespace polygmap {

// The gradient is that of the normal image (creases) joined by depth jumps; both are dimensionless. Passes, each over
// all rows in order: gradient_row, suppress_row, then grow_row downwards and upwards in turn.
class EdgeDetection {
 public:
  struct Params {
    double low = 0.22;  // hysteresis thresholds, change of the unit normal over two pixels
    double high = 0.36;
    double jump_m = 0.02;  // a depth step of jump_m + jump_per_m2 z^2 counts as an edge of strength high
    double jump_per_m2 = 0.01;
    std::int32_t sweeps = 4;  // hysteresis: alternating downwards and upwards
  };
  static constexpr std::int32_t kMaxSweeps = 8;

  void gradient_row(const Params& params, const HalfRays& rays, const NormalImage& normals,
                    const InverseDepthImage& smoothed, std::int32_t row) noexcept;
  void suppress_row(const Params& params, const HalfRays& rays, std::int32_t row) noexcept;
  // Weak pixels that touch a strong one become strong, in the sweep's direction along the row too.
  void grow_row(std::int32_t width_px, std::int32_t height_px, std::int32_t row, bool downwards) noexcept;

  [[nodiscard]] bool edge(std::int32_t column, std::int32_t row) const noexcept {
    return marks_(column, row) == kStrong;
  }

 private:
  enum State : std::uint8_t { kNone, kWeak, kStrong };
  static constexpr float kQuantum = 100.0F;  // strength 1.0 in the stored image

  HalfImage<std::uint8_t> strength_{};
  // The gradient's direction (0..3) until suppress_row has read it, then the pixel's state.
  HalfImage<std::uint8_t> marks_{};
  std::array<bool, kHalfHeight_px> has_weak_{};
  std::array<float, kHalfWidth_px> row_strength_{};
  std::array<float, kHalfWidth_px> row_direction_{};
};

}  // namespace polygmap
