// SPDX-License-Identifier: Apache-2.0
// Raw depth to half-resolution inverse depth.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/image/depth_range.hpp"
#include "tests/reference/paper_route/half_depth.hpp"

namespace polygmap {

class DepthReduction {
 public:
  struct Params {
    DepthLimits limits;
    double jump_m = 0.012;       // depths inside one cell that differ by more than jump_m + jump_per_m2 z^2 ...
    double jump_per_m2 = 0.015;  // ... belong to two surfaces: the nearer one is kept, never a mean of both
  };

  void set(const Params& params, double depth_unit_m) noexcept;

  // Two full-resolution rows to one row of inverse depth (1/m) and flags; flags are overwritten. The value is the mean
  // of the middle two of four valid pixels, the median of three: one flying pixel per cell does no harm.
  void reduce_row(const std::uint16_t* upper, const std::uint16_t* lower, std::int32_t half_width_px,
                  float* inverse_depth, std::uint8_t* flags) const noexcept;

 private:
  using Cells = std::array<std::array<float, kHalfWidth_px>, 4>;

  RawRange range_;
  float unit_m_ = 0.001F;
  float jump_raw_ = 0.0F;
  float jump_per_raw2_ = 0.0F;
};

// Holes of up to two pixels get the mean of the measured pixels around them, for the smoothed image only: no fit sees
// them. Reads rows row - 2 .. row + 2 of measured; body pixels stay empty.
void fill_holes_row(const InverseDepthImage& measured, const HalfImage<std::uint8_t>& flags, std::int32_t row,
                    std::int32_t width_px, std::int32_t height_px, float* filled) noexcept;

}  // namespace polygmap
