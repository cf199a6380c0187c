// SPDX-License-Identifier: Apache-2.0
// RANSAC for a plane with deterministic draws and a weighted least-squares refinement.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/perception/planes/plane_fit.hpp"

namespace polygmap {

// One measured pixel.
struct PlaneSample {
  float x = 0.0F;  // ray
  float y = 0.0F;
  float w = 0.0F;  // inverse depth, 1/m
};

// sigma of an inverse depth on the plane: sigma_z w^2 with sigma_z of the noise model and cos(incidence) = w d / |ray|.
[[nodiscard]] double inverse_depth_sigma(const DepthNoiseModel& noise, const InversePlane& plane,
                                         const Vec3& ray) noexcept;

// RANSAC over a list of samples, one trial per call so that it can be resumed.
class PlaneRansac {
 public:
  struct Params {
    std::int32_t trials = 24;
    double inlier_sigmas = 3.0;
    double inlier_floor_m = 0.002;  // added: slow depth errors that the noise model does not have
    double enough_inliers = 0.92;   // stop drawing at this share
    PlaneFit::Params fit;
  };

  void begin(std::uint32_t seed, std::span<const PlaneSample> samples) noexcept;
  // Draw number trial; true when no further draw is wanted.
  bool step(const Params& params, const DepthNoiseModel& noise, Lean lean, const Vec3& up) noexcept;
  // Refines the best draw by two rounds of truncated least squares. False when nothing was found.
  [[nodiscard]] bool try_finish(const Params& params, const DepthNoiseModel& noise, Lean lean, const Vec3& up,
                                InversePlane& plane, std::int32_t& inliers) const noexcept;
  [[nodiscard]] std::int32_t trials() const noexcept { return trial_; }

 private:
  std::span<const PlaneSample> samples_{};
  std::uint32_t seed_ = 0;
  std::int32_t trial_ = 0;
  std::int32_t best_inliers_ = 0;
  InversePlane best_;
};

}  // namespace polygmap
