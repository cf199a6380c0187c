// SPDX-License-Identifier: Apache-2.0
// Where a picture shows the toe of a standing foot, against where the encoders have it. Where a camera sits along the
// ground cannot be told from level surfaces, and a foothold is off by as much; the robot's own toe tells, whenever a
// standing leg is so straight that its knee does not hide it. The foot's shape is its collision box.
#pragma once

#include <cstdint>
#include <optional>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/perception/image/depth_range.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

struct ToeSighting {
  double ahead_m = 0.0;  // by how much the toe is seen ahead of where the encoders have it, along the sole's x axis
  double sigma_m = 0.0;  // of the picture alone
};

// frame: of the size of the intrinsics. camera_T_sole: at the exposure, by encoders and the mount as believed. Follows
// lines along the foot's upper face over its front edge, beyond which depth jumps; nothing where too few lines show one
// jump at one place, because the toe is hidden, out of the picture or close to a riser.
[[nodiscard]] std::optional<ToeSighting> detect_toe(const DepthFrameView& frame, const CameraIntrinsics& intrinsics,
                                                    const RawRange& range, const SoleModel& sole,
                                                    const Transform& camera_T_sole) noexcept;

}  // namespace polygmap
