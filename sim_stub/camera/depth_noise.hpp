// SPDX-License-Identifier: Apache-2.0
// From an ideal picture to what a depth camera delivers: noise, edge mixing, dropouts, warp, scale, quantisation.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "algorithms/perception/image/depth_noise_model.hpp"
#include "sim_stub/camera/counter_noise.hpp"
#include "sim_stub/camera/depth_renderer.hpp"
#include "sim_stub/camera/noise_kind.hpp"

namespace polygmap::sim {

struct DepthNoiseTables;

// sigma = (1 + 1.5 z) mm / cos(incidence) unless told otherwise, clamped at 75 degrees. Correlated noise adds spatial
// correlation over 9 px (of the variance neighbours share the sigma's correlated_share, 8/9 at most), dropouts in
// blobs, and a slow warp of which half the variance is the seed's and half is redrawn with 0.5 s correlation. Random
// values come from fixed tables read at random offsets per frame (correlated) or per row (white): one load a pixel.
class CameraNoise {
 public:
  struct Params {
    NoiseKind kind = NoiseKind::kWhite;
    DepthNoiseModel sigma{};
    double scale = 1.0;     // of the depth: the seed's calibration error
    double strength = 1.0;  // of sigma and warp; 0 switches edge mixing and dropouts off too
    double warp_m = 0.002;  // standard deviation, correlated noise only
    double range_m = 6.0;
  };
  CameraNoise(const Params& params, const CameraIntrinsics& intrinsics, std::uint64_t seed);

  // time_s since the start; depth takes width x height values, 0 = invalid.
  void apply(const DepthRenderer& picture, std::uint64_t frame, double time_s, std::uint16_t* depth);

 private:
  void prepare_warp(double time_s);
  void warp_row(int v);
  void mix_edges(std::uint64_t frame, int v, const float* z_mm, const float* z_below_mm);

  Params params_;
  CameraIntrinsics intrinsics_;
  std::uint64_t seed_;
  CounterNoise frame_noise_, row_noise_, edge_noise_;
  std::shared_ptr<const DepthNoiseTables> tables_;
  std::vector<float> fixed_warp_, earlier_warp_, later_warp_, warp_;  // coarse grids, unit variance; their sum in mm
  std::int64_t warp_key_ = -1;
  std::vector<float> warp_row_, depth_row_, z_row_, z_below_row_;
  std::vector<std::uint8_t> jump_;
};

}  // namespace polygmap::sim
