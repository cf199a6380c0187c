// SPDX-License-Identifier: Apache-2.0
// A depth camera as data: intrinsics, noise and range from a TOML file (firmware/cameras has some).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "algorithms/perception/image/depth_image.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "firmware/config/file_error.hpp"

namespace polygmap::config {

// A picture that the tool may read is at least and at most this large.
inline constexpr std::int32_t kLeastSide_px = 32, kMaxWidth_px = 1024, kMaxHeight_px = 768;

struct CameraProfile {
  CameraIntrinsics intrinsics;
  DepthNoiseModel noise;
  double min_depth_m = 0.2;
  double max_depth_m = 6.0;
};

// Throws FileError, one sentence that names file, line and key.
[[nodiscard]] CameraProfile read_camera(const std::string& path);
// path: what the text is called.
[[nodiscard]] CameraProfile parse_camera(const std::string& path, std::string_view text);

}  // namespace polygmap::config
