// SPDX-License-Identifier: Apache-2.0
// What was found in a depth picture, drawn over it for people.
#pragma once

#include <string>
#include <vector>

#include "sim_stub/host/perceive/perceive.hpp"

namespace polygmap::sim {

// A PNG: planes in the colours of their kinds, each with its id, polygons, nosings, and a legend below. A picture that
// is narrower than kLeastDrawn_px is drawn larger, by a whole factor, so that what is written in it can be read.
inline constexpr std::int32_t kLeastDrawn_px = 480;
[[nodiscard]] std::vector<unsigned char> picture_png(const config::CameraProfile& camera, const DepthPng& picture,
                                                     const Perceived& perceived);

// Throws config::FileError when the file cannot be written.
void write_picture(const std::string& path, const config::CameraProfile& camera, const DepthPng& picture,
                   const Perceived& perceived);

}  // namespace polygmap::sim
