// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/picture_monitor.hpp"

namespace polygmap {

void PictureMonitor::take(const DepthFrameView& frame, const CameraIntrinsics& intrinsics, const RawRange& range,
                          const Transform& camera_T_way, double noise_scale) noexcept {
  constexpr double kNear_m = 0.1;  // a guard of the division
  int shown = 0, missing = 0;
  for (int i = 0; i < kAhead; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const double x_m = params_.from_m + (params_.to_m - params_.from_m) * i / (kAhead - 1);
      const double y_m = params_.half_width_m * (2.0 * j / (kAcross - 1) - 1.0);
      const Vec3 p_m = camera_T_way * Vec3{x_m, y_m, 0.0};
      if (!(p_m.z() > kNear_m)) continue;
      const double u = p_m.x() / p_m.z() * intrinsics.fx_px + intrinsics.cx_px + 0.5;
      const double v = p_m.y() / p_m.z() * intrinsics.fy_px + intrinsics.cy_px + 0.5;
      if (!(u >= 0.0 && v >= 0.0 && u < intrinsics.width_px && v < intrinsics.height_px)) continue;
      ++shown;
      const auto row = static_cast<std::size_t>(v), column = static_cast<std::size_t>(u);
      if (!range.valid(frame.depth[row * static_cast<std::size_t>(intrinsics.width_px) + column])) ++missing;
    }
  }
  if (2 * shown >= kAhead * kAcross) {
    missing_share_ += params_.gain * (static_cast<double>(missing) / shown - missing_share_);
  }
  noise_scale_ += params_.gain * (noise_scale - noise_scale_);
}

StopReason PictureMonitor::explain(StopReason found, bool climbing) const noexcept {
  switch (found) {
    case StopReason::kEdgeUncertain:
      if (!climbing) return found;
      [[fallthrough]];
    case StopReason::kNothingSeen:
    case StopReason::kNoStaircase:
    case StopReason::kUnsteady:
      return lacks_depth() ? StopReason::kDepthMissing : is_noisy() ? StopReason::kDepthNoisy : found;
    case StopReason::kRiseTooHigh:
    case StopReason::kTreadTooShort:
    case StopReason::kTooNarrow:
      return lacks_depth() ? StopReason::kDepthMissing : found;
    default:
      return found;
  }
}

}  // namespace polygmap
