// SPDX-License-Identifier: Apache-2.0
// Edge-preserving smoothing, eq. (13).
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/image/depth_noise_model.hpp"
#include "tests/reference/paper_route/half_depth.hpp"

namespace polygmap {

// One pass over all rows, in order, is one iteration of eq. (13) over the four neighbours, in place. I is inverse depth
// rather than the paper's depth: a slanted plane then has no curvature that diffusion would bend. The conductivity is
// c = 1 / (1 + (difference / kappa)^2), kappa following the noise with distance; or, as published, exp(-(difference /
// kappa)^2) with one kappa for all distances.
class AnisotropicDiffusion {
 public:
  struct Params {
    std::int32_t iterations = 5;
    double lambda = 0.2;        // stable up to 1/4
    double kappa_sigmas = 4.0;  // a depth difference of this many sigmas conducts half
    double kappa_m = 0.0;       // above 0: the published conductivity, with this kappa
  };

  void begin_iteration() noexcept { flux_above_.fill(0.0F); }
  // Row row of image, which must still hold the old values of this row and the next. Empty pixels (0) neither give nor
  // take.
  void step_row(const Params& params, const DepthNoiseModel& noise, InverseDepthImage& image, std::int32_t row,
                std::int32_t width_px, std::int32_t height_px) noexcept;

 private:
  std::array<float, kHalfWidth_px> flux_above_{};     // from the row above into this one
  std::array<float, kHalfWidth_px + 1> flux_left_{};  // across each pixel's left side
  std::array<float, kHalfWidth_px> flux_below_{};
};

}  // namespace polygmap
