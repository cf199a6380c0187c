// SPDX-License-Identifier: Apache-2.0
// The camera's port on the way to the module: keeps a small copy of some pictures, for people to look at.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hal/ports/depth_camera.hpp"

namespace polygmap::sim {

// Every n-th pixel of every n-th row, 8 bits: 0 has no depth, 1 to 255 are kNearest_m to kFarthest_m.
struct Preview {
  static constexpr int kEvery_px = 4;
  static constexpr double kNearest_m = 0.3, kFarthest_m = 3.0;
  static constexpr std::int64_t kPeriod_ns = 200'000'000;  // from one to the next
  std::int64_t stamp_ns = 0;
  std::uint32_t width_px = 0, height_px = 0;
  std::vector<std::uint8_t> pixels;
};

// Of a picture whose size is the camera's. Allocates nothing where the preview has its size already.
void fill(Preview& preview, const DepthFrameView& frame, double depth_unit_m);
[[nodiscard]] std::vector<unsigned char> png_of(const Preview& preview);

class PreviewCamera final : public hal::DepthCamera {
 public:
  explicit PreviewCamera(hal::DepthCamera& camera);
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return camera_.intrinsics(); }
  // Allocates nothing.
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override;
  void release() noexcept override { camera_.release(); }
  // A new one since the last call, or null.
  [[nodiscard]] const Preview* take() noexcept;

 private:
  hal::DepthCamera& camera_;
  Preview preview_;
  bool is_new_ = false;
  std::int64_t next_ns_ = 0;
};

}  // namespace polygmap::sim
