// SPDX-License-Identifier: Apache-2.0
// A depth camera as data: intrinsics, noise and range from a TOML file (firmware/cameras has some).
#pragma once

#include <stdexcept>
#include <string>

#include "algorithms/perception/depth_sigma.hpp"
#include "algorithms/perception/images.hpp"

namespace polygmap::sim {

// What a user is told about a file, in one sentence.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct CameraProfile {
  CameraIntrinsics intrinsics;
  DepthSigma noise;
  double min_depth_m = 0.2;
  double max_depth_m = 6.0;
};

// Throws FileError.
[[nodiscard]] CameraProfile read_camera(const std::string& path);

}  // namespace polygmap::sim
