// SPDX-License-Identifier: Apache-2.0
// How noisy the frames are, by depth, and the camera's noise as it is believed from frame to frame.
//
// A profile may be too optimistic by a factor, and it may lack the part that grows with the square of the depth: the
// disparity noise and quantization of stereo and structured light, and warp. One factor cannot follow both: what is far
// away then makes the near too coarse, or the near makes the far shatter.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"

namespace polygmap {

// Squared residuals of rows from their planes, over the variance that is believed.
class NoiseSamples {
 public:
  struct Seen {
    double z_m = 0.0;    // mean depth
    double scale = 0.0;  // the noise there over what is believed
    double rows = 0.0;   // that say so
  };
  static constexpr std::size_t kDepths = 8;

  void clear() noexcept { depths_ = {}; }
  // inverse_depth: 1/m, more than 0.
  void add(float inverse_depth, float cost) noexcept;
  // Ranges of depth with fewer rows are left out.
  [[nodiscard]] StaticVector<Seen, kDepths> seen(std::int32_t min_rows) const noexcept;

 private:
  static constexpr std::int32_t kCostBins = 128;  // of 0.25: up to 5.7 sigmas
  struct AtDepth {
    std::array<std::int32_t, kCostBins + 1> rows{};
    double sum_z_m = 0.0;
  };
  std::array<AtDepth, kDepths> depths_{};
};

class NoiseTracker {
 public:
  struct Params {
    double gain = 0.1;
    double min_scale = 1.0;
    double max_scale = 4.0;
    double max_quadratic_per_m = 0.005;
    std::int32_t min_rows = 60;

    static void visit(auto& p, auto& field) {
      field("gain", p.gain, 0.0, 1.0, "Share of a frame's noise in what is believed after it.");
      field("min_scale", p.min_scale, 0.1, 10.0, "The noise is believed down to this times the stated one.");
      field("max_scale", p.max_scale, 0.1, 100.0, "The noise is believed up to this times the stated one.");
      field.ordered("min_scale", "max_scale");
      field("max_quadratic_per_m", p.max_quadratic_per_m, 0.0, 0.1,
            "The noise grows no faster with the square of the depth: more than stereo of 50 mm base line has.");
      field("min_rows", p.min_rows, 1, 100000, "A range of depths with fewer rows says nothing of the noise.");
    }
  };
  // The profile as it is believed.
  [[nodiscard]] DepthNoiseModel of(const DepthNoiseModel& profile) const noexcept;
  // Least squares of scale x profile + quadratic z^2 against what was seen while `of` was believed.
  void follow(const Params& params, const DepthNoiseModel& profile, const NoiseSamples& samples) noexcept;

 private:
  double scale_ = 1.0;
  double quadratic_per_m_ = 0.0;
};

}  // namespace polygmap
