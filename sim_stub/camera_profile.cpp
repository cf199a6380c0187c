// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/camera_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

namespace polygmap::sim {
namespace {

class CameraFile {
 public:
  explicit CameraFile(const std::string& path) : path_(path), parsed_(toml::parse_file(path)) {
    if (!parsed_) {
      throw FileError("Cannot read the camera file \"" + path + "\": " + std::string(parsed_.error().description()) +
                      ".");
    }
    constexpr std::array<std::string_view, 14> kKeys{"width",
                                                     "height",
                                                     "fx",
                                                     "fy",
                                                     "cx",
                                                     "cy",
                                                     "depth_unit_m",
                                                     "min_depth_m",
                                                     "max_depth_m",
                                                     "noise_base_m",
                                                     "noise_per_metre",
                                                     "noise_quadratic_per_m",
                                                     "noise_correlated_share",
                                                     "noise_correlated_px"};
    for (const auto& [key, value] : parsed_.table()) {
      if (std::find(kKeys.begin(), kKeys.end(), key.str()) == kKeys.end()) {
        fail(std::string(key.str()) + " is no key of a camera.");
      }
    }
  }
  [[noreturn]] void fail(const std::string& what) const { throw FileError("Camera file \"" + path_ + "\": " + what); }
  [[nodiscard]] double number(const char* key, std::optional<double> otherwise = {}) const {
    const toml::node* node = parsed_.table().get(key);
    if (node == nullptr) {
      if (otherwise) return *otherwise;
      throw FileError("Camera file \"" + path_ + "\" has no " + key + ".");
    }
    const auto value = node->value<double>();
    if (!value || !std::isfinite(*value)) fail(std::string(key) + " must be a finite number.");
    return *value;
  }

 private:
  std::string path_;
  toml::parse_result parsed_;
};

}  // namespace

CameraProfile read_camera(const std::string& path) {
  const CameraFile file(path);
  CameraProfile camera;
  CameraIntrinsics& k = camera.intrinsics;
  const double width = file.number("width"), height = file.number("height");
  if (width < 32 || height < 32 || width > kDepthWidth_px || height > kDepthHeight_px) {
    file.fail("pictures from 32x32 to " + std::to_string(kDepthWidth_px) + "x" + std::to_string(kDepthHeight_px) +
              " are read, not " + std::to_string(std::lround(width)) + "x" + std::to_string(std::lround(height)) + ".");
  }
  k.width_px = static_cast<std::int32_t>(width);
  k.height_px = static_cast<std::int32_t>(height);
  k.fx_px = file.number("fx");
  k.fy_px = file.number("fy");
  k.cx_px = file.number("cx");
  k.cy_px = file.number("cy");
  k.depth_unit_m = file.number("depth_unit_m");
  camera.min_depth_m = file.number("min_depth_m", camera.min_depth_m);
  camera.max_depth_m = file.number("max_depth_m", camera.max_depth_m);
  DepthSigma& noise = camera.noise;
  noise.base_m = file.number("noise_base_m", noise.base_m);
  noise.per_metre = file.number("noise_per_metre", noise.per_metre);
  noise.quadratic_per_m = file.number("noise_quadratic_per_m", noise.quadratic_per_m);
  noise.correlated_share = file.number("noise_correlated_share", noise.correlated_share);
  noise.correlated_px = file.number("noise_correlated_px", noise.correlated_px);
  if (!(k.fx_px > 1.0) || !(k.fy_px > 1.0) || !(k.depth_unit_m > 0.0) || !(noise.base_m > 0.0) ||
      !(noise.per_metre >= 0.0) || !(noise.quadratic_per_m >= 0.0) || !(camera.min_depth_m > 0.0) ||
      !(camera.max_depth_m > camera.min_depth_m)) {
    file.fail("focal lengths, depth unit, noise and depth range must be positive.");
  }
  if (!(noise.correlated_share >= 0.0 && noise.correlated_share <= 1.0) || !(noise.correlated_px >= 1.0)) {
    file.fail("noise_correlated_share must be from 0 to 1, noise_correlated_px at least 1.");
  }
  return camera;
}

}  // namespace polygmap::sim
