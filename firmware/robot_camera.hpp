// SPDX-License-Identifier: Apache-2.0
// The robot's camera, as firmware/cameras/kuavo.toml has it: CMakeLists.txt refuses other numbers.
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

[[nodiscard]] inline CameraIntrinsics robot_camera_intrinsics() noexcept {
  return {640, 480, 366.7, 366.8, 322.7, 242.3, 0.00025};
}

}  // namespace polygmap
