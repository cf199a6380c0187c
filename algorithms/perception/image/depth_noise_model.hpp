// SPDX-License-Identifier: Apache-2.0
// How noisy a depth camera is.
#pragma once

namespace polygmap {

// A camera's depth noise. Standard deviation along the optical axis: (base + per_metre z + quadratic z^2) /
// cos(incidence); the last term is that of stereo, whose disparities are equally uncertain at any range.
struct DepthNoiseModel {
  double base_m = 0.001;
  double per_metre = 0.0015;
  double quadratic_per_m = 0.0;
  double correlated_share = 0.7;
  // Pixels that are worth one independent measurement: depth errors are correlated over 9 pixels and warp slowly over
  // 70. Sets how much a plane's lean counts against its pixels, and its covariance.
  double correlated_px = 640.0;

  [[nodiscard]] DepthNoiseModel scaled(double factor) const noexcept {
    return {factor * base_m, factor * per_metre, factor * quadratic_per_m, correlated_share, correlated_px};
  }
  [[nodiscard]] double sigma_m(double z_m) const noexcept { return base_m + z_m * (per_metre + quadratic_per_m * z_m); }
  // Of the inverse depth w = 1 / z: sigma_z w^2, 1/m.
  [[nodiscard]] double inverse_sigma(double w) const noexcept { return (base_m * w + per_metre) * w + quadratic_per_m; }

  static void visit(auto& p, auto& field) {
    field("base_m", p.base_m, 1e-6, 0.05, "Noise of a depth at no distance.");
    field("per_metre", p.per_metre, 0.0, 0.1, "The noise grows by this with the depth.");
    field("quadratic_per_m", p.quadratic_per_m, 0.0, 0.1,
          "The noise grows by this with the depth's square, as that of stereo does.");
    field("correlated_share", p.correlated_share, 0.0, 1.0,
          "Share of a pixel's variance that its neighbours in the row share.");
    field("correlated_px", p.correlated_px, 1.0, 1e6, "As many pixels are worth one independent measurement.");
  }
};

}  // namespace polygmap
