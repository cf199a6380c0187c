// SPDX-License-Identifier: Apache-2.0
// The module's plane extraction on depth pictures from files: what `polygmap perceive` does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/config/camera_file.hpp"
#include "sim_stub/host/interrupted.hpp"
#include "sim_stub/host/perceive/frame_extraction.hpp"

namespace polygmap::sim {

struct DepthPng {
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  std::vector<std::uint16_t> depth;
};

[[nodiscard]] std::string size_text(std::int64_t width, std::int64_t height);  // as people write it

// Throws config::FileError.
[[nodiscard]] DepthPng read_depth(const std::string& path);

using polygmap_frames::Surface;
// The surfaces that were cut from one plane (on both sides of a leg, of a staircase), the largest first; never none.
using PerceivedPlane = std::vector<Surface>;

enum class UpSource : std::uint8_t {
  kGiven,
  kFound,   // in the picture
  kAssumed  // no plane looks level: up is up in the picture, and what is a tread is not known
};
[[nodiscard]] const char* name_of(UpSource source);
// As planes.json has it: tread, riser, other, or unknown where up was assumed.
[[nodiscard]] const char* kind_name(const Surface& surface, UpSource up);

// Of the normal and d_m together: the surface has that of -normal / d_m.
[[nodiscard]] Eigen::Matrix4d plane_covariance(const Surface& surface);

struct Perceived {
  std::vector<PerceivedPlane> planes;  // id is the index + 1
  std::vector<std::uint8_t> labels;    // per pixel, 0 = none
  Vec3 camera_up = Vec3::Zero();
  UpSource up_source = UpSource::kAssumed;
  std::optional<Vec3> found_up;      // by the largest plane that looks level, whether up was given or not
  double in_range_share = 0.0;       // of the pixels: with a depth that the camera's file has in its range
  std::vector<double> microseconds;  // one per repetition
};

// gravity: down, camera frame; without it, the largest plane that looks level says where up is. Throws Interrupted.
[[nodiscard]] Perceived perceive(const config::CameraProfile& camera, const DepthPng& picture,
                                 const std::optional<Vec3>& gravity, int repeat,
                                 const polygmap_frames::Values& values = {},
                                 const std::atomic<int>* interrupt = nullptr);

// One sentence where hardly a pixel is in the camera's range; or where the picture contradicts the direction given:
// what is level by it faces downwards, and nothing level faces upwards; or the largest plane that looks level is none
// by it, and less is. Else empty.
[[nodiscard]] std::string doubt_of(const Perceived& perceived);

// Throw config::FileError when the file cannot be written.
void write_labels(const std::string& path, const DepthPng& picture, const Perceived& perceived);
void write_planes(const std::string& path, const Perceived& perceived, const std::string& params_hash);

}  // namespace polygmap::sim
