// SPDX-License-Identifier: Apache-2.0
// Whether the camera's pictures are good enough to step by: how much of the way ahead has no depth, as under sunlight
// or on dark and shiny treads, and how noisy the depth is. Surfaces are fitted to what is left, so where the search
// finds no way the reason may be the picture, and not the stairs.
#pragma once

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/perception/image/depth_range.hpp"

namespace polygmap {

class PictureMonitor {
 public:
  struct Params {
    double from_m = 0.25, to_m = 1.15;
    double half_width_m = 0.25;
    // Chosen in the simulation (2026-11-28), and tried on no camera.
    double most_missing = 0.3;
    double most_noise = 3.0;
    double gain = 0.1;

    static void visit(auto& p, auto& field) {
      field("from_m", p.from_m, 0.0, 3.0, "The way is looked at from this far ahead of the soles' middle.");
      field("to_m", p.to_m, 0.1, 5.0, "The way is looked at up to this far ahead of the soles' middle.");
      field.ordered("from_m", "to_m");
      field("half_width_m", p.half_width_m, 0.01, 2.0, "The way is looked at this far to either side.");
      field("most_missing", p.most_missing, 0.0, 1.0, "A larger share of the way without depth is a bad picture.");
      field("most_noise", p.most_noise, 1.0, 100.0, "Noise of more than this times the stated one is a bad picture.");
      field("gain", p.gain, 0.001, 1.0, "Share of a picture in what is judged after it.");
    }
  };

  explicit PictureMonitor(const Params& params) noexcept : params_(params) {}

  // camera_T_way: at the exposure; level, x ahead, from the middle between the soles. noise_scale: of the depths, over
  // what the data sheet says. A picture that shows less than half of the way says nothing of it.
  void take(const DepthFrameView& frame, const CameraIntrinsics& intrinsics, const RawRange& range,
            const Transform& camera_T_way, double noise_scale) noexcept;

  // Means over the last pictures: the share of the way without depth, and the noise over the stated one.
  [[nodiscard]] double missing_share() const noexcept { return missing_share_; }
  [[nodiscard]] double noise_scale() const noexcept { return noise_scale_; }
  [[nodiscard]] bool is_bad() const noexcept { return lacks_depth() || is_noisy(); }
  // What the search found in the way, or the bad picture that may be why. climbing: before the first step a vague edge
  // is walked up to.
  [[nodiscard]] StopReason explain(StopReason found, bool climbing) const noexcept;

  static constexpr int kAhead = 10, kAcross = 7;  // places that are looked at
  static constexpr std::int32_t kInstructions = 150 + 60 * kAhead * kAcross;

 private:
  [[nodiscard]] bool lacks_depth() const noexcept { return missing_share_ > params_.most_missing; }
  [[nodiscard]] bool is_noisy() const noexcept { return noise_scale_ > params_.most_noise; }

  Params params_;
  double missing_share_ = 0.0;
  double noise_scale_ = 1.0;
};

}  // namespace polygmap
