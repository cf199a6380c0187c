// SPDX-License-Identifier: Apache-2.0
// The module's plane extraction behind types that know nothing of its capacities.
//
// The extractor's memory is static, for pictures of up to 640x480. The host tool has it twice: as the module has it,
// and compiled again from the same files (CMakeLists.txt here) with larger capacities and with `polygmap` defined to be
// polygmap_1024x768, so that no name of the one is a name of the other. What both include must not live in `polygmap`.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace polygmap_frames {

inline constexpr std::int32_t kLeastSide_px = 32, kMaxWidth_px = 1024, kMaxHeight_px = 768;

struct Camera {  // as CameraIntrinsics, DepthLimits and DepthNoiseModel have it
  std::int32_t width_px = 0, height_px = 0;
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0, depth_unit_m = 0.0;
  double min_depth_m = 0.0, max_depth_m = 0.0;
  double noise_base_m = 0.0, noise_per_metre = 0.0, noise_quadratic_per_m = 0.0;
  double noise_correlated_share = 0.0, noise_correlated_px = 0.0;
};

// Numbers of SurfaceExtractor::Params that are not the default, by their names in the table of parameters.
using Values = std::vector<std::pair<std::string, double>>;

enum class Kind : std::uint8_t { kTread, kRiser, kOther };

struct Surface {  // as SurfacePatch has it, camera frame
  Kind kind = Kind::kOther;
  std::uint8_t plane = 0;
  Eigen::Vector3d normal, centroid_m;
  double d_m = 0.0, area_m2 = 0.0, rmse_m = 0.0, invalid_fraction = 0.0;
  Eigen::Matrix3d covariance;  // of -normal / d_m
  std::vector<Eigen::Vector3d> polygon_m;
  std::optional<std::array<Eigen::Vector3d, 2>> nosing_m;
};

class Extractor {
 public:
  virtual ~Extractor() = default;
  // depth: the camera's width x height, row-major. The microseconds it took; none when the camera, whose size must be a
  // multiple of 8 and of 2, or up (unit, camera frame) is refused.
  [[nodiscard]] virtual std::optional<double> extract(const std::uint16_t* depth, const Eigen::Vector3d& up) = 0;
  // Of the last picture, whose depth must live as long as surface_at is asked.
  [[nodiscard]] virtual std::vector<Surface> surfaces() const = 0;
  [[nodiscard]] virtual std::size_t surface_at(std::int32_t column, std::int32_t row) const = 0;  // 1-based, 0 = none
  [[nodiscard]] virtual double noise_sigma_m(double z_m) const = 0;  // as it is believed for the next picture
  virtual void hold_noise() = 0;
};

}  // namespace polygmap_frames

namespace polygmap {
[[nodiscard]] bool holds(const polygmap_frames::Camera& camera);
[[nodiscard]] std::unique_ptr<polygmap_frames::Extractor> make_extractor(const polygmap_frames::Camera& camera,
                                                                         const polygmap_frames::Values& values);
}  // namespace polygmap

namespace polygmap_1024x768 {
[[nodiscard]] std::unique_ptr<polygmap_frames::Extractor> make_extractor(const polygmap_frames::Camera& camera,
                                                                         const polygmap_frames::Values& values);
}  // namespace polygmap_1024x768
