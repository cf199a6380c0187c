// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/record/preview_camera.hpp"

#include <algorithm>
#include <cmath>

namespace polygmap::sim {

PreviewCamera::PreviewCamera(hal::DepthCamera& camera) : camera_(camera) {
  const CameraIntrinsics size = camera.intrinsics();
  preview_.width_px = static_cast<std::uint32_t>(size.width_px / Preview::kEvery_px);
  preview_.height_px = static_cast<std::uint32_t>(size.height_px / Preview::kEvery_px);
  preview_.pixels.resize(std::size_t{preview_.width_px} * preview_.height_px);
}

bool PreviewCamera::try_acquire(DepthFrameView& frame) noexcept {
  if (!camera_.try_acquire(frame)) return false;
  const CameraIntrinsics size = camera_.intrinsics();
  if (frame.stamp_ns < next_ns_ || frame.depth == nullptr || frame.width_px != size.width_px) return true;
  next_ns_ = frame.stamp_ns + kPeriod_ns;
  preview_.stamp_ns = frame.stamp_ns;
  for (std::uint32_t y = 0; y < preview_.height_px; ++y) {
    const std::uint16_t* row =
        frame.depth + std::size_t{y} * Preview::kEvery_px * static_cast<std::size_t>(size.width_px);
    for (std::uint32_t x = 0; x < preview_.width_px; ++x) {
      const std::uint16_t raw = row[x * Preview::kEvery_px];
      constexpr double kSteps = 254.0;
      const double share =
          (size.depth_unit_m * raw - Preview::kNearest_m) / (Preview::kFarthest_m - Preview::kNearest_m);
      const auto level = static_cast<std::uint8_t>(1.0 + std::clamp(kSteps * share, 0.0, kSteps));
      preview_.pixels[std::size_t{y} * preview_.width_px + x] = raw == 0 ? std::uint8_t{0} : level;
    }
  }
  is_new_ = true;
  return true;
}

const Preview* PreviewCamera::take() noexcept {
  const bool was_new = is_new_;
  is_new_ = false;
  return was_new ? &preview_ : nullptr;
}

}  // namespace polygmap::sim
