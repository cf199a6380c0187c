// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/record/preview_camera.hpp"

#include <lodepng.h>

#include <algorithm>

namespace polygmap::sim {

void fill(Preview& preview, const DepthFrameView& frame, double depth_unit_m) {
  preview.stamp_ns = frame.stamp_ns;
  preview.width_px = static_cast<std::uint32_t>(frame.width_px / Preview::kEvery_px);
  preview.height_px = static_cast<std::uint32_t>(frame.height_px / Preview::kEvery_px);
  preview.pixels.resize(std::size_t{preview.width_px} * preview.height_px);
  for (std::uint32_t y = 0; y < preview.height_px; ++y) {
    const std::uint16_t* row =
        frame.depth + std::size_t{y} * Preview::kEvery_px * static_cast<std::size_t>(frame.width_px);
    for (std::uint32_t x = 0; x < preview.width_px; ++x) {
      const std::uint16_t raw = row[x * Preview::kEvery_px];
      constexpr double kSteps = 254.0;
      const double share = (depth_unit_m * raw - Preview::kNearest_m) / (Preview::kFarthest_m - Preview::kNearest_m);
      const auto level = static_cast<std::uint8_t>(1.0 + std::clamp(kSteps * share, 0.0, kSteps));
      preview.pixels[std::size_t{y} * preview.width_px + x] = raw == 0 ? std::uint8_t{0} : level;
    }
  }
}

std::vector<unsigned char> png_of(const Preview& preview) {
  std::vector<unsigned char> png;
  (void)lodepng::encode(png, preview.pixels, preview.width_px, preview.height_px, LCT_GREY, 8);
  return png;
}

PreviewCamera::PreviewCamera(hal::DepthCamera& camera) : camera_(camera) {
  const CameraIntrinsics size = camera.intrinsics();
  preview_.pixels.resize(static_cast<std::size_t>(size.width_px / Preview::kEvery_px) *
                         static_cast<std::size_t>(size.height_px / Preview::kEvery_px));
}

bool PreviewCamera::try_acquire(DepthFrameView& frame) noexcept {
  if (!camera_.try_acquire(frame)) return false;
  const CameraIntrinsics size = camera_.intrinsics();
  const bool is_cameras = frame.width_px == size.width_px && frame.height_px == size.height_px;
  if (frame.stamp_ns < next_ns_ || frame.depth == nullptr || !is_cameras) return true;
  next_ns_ = frame.stamp_ns + Preview::kPeriod_ns;
  fill(preview_, frame, size.depth_unit_m);
  is_new_ = true;
  return true;
}

const Preview* PreviewCamera::take() noexcept {
  const bool was_new = is_new_;
  is_new_ = false;
  return was_new ? &preview_ : nullptr;
}

}  // namespace polygmap::sim
