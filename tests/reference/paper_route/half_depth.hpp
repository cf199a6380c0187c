// SPDX-License-Identifier: Apache-2.0
// The picture that the paper's route works on: inverse depth at half resolution.
#pragma once

#include "algorithms/perception/image/depth_image.hpp"

namespace polygmap {

// Inverse depth, 1/m, 0 = nothing measured. On a plane it is linear in the image, which depth is not: smoothing,
// fitting and comparing with a plane need no back-projection and have no bias on slanted surfaces.
using InverseDepthImage = HalfImage<float>;

// Beside PixelFlag: at least one of the four full-resolution pixels is valid.
inline constexpr std::uint8_t kPixelMeasured = 1;

}  // namespace polygmap
