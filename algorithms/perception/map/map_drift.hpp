// SPDX-License-Identifier: Apache-2.0
// By how much the pose's odometry has moved against that of the map.
#pragma once

#include <cstdint>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

// What all surfaces of a frame are off by in common is an error of the pose, as far as the pose's covariance allows for
// one; what is left is news about the surfaces. Two estimates from the same residuals: the frame's own offset, jitter
// of its pose included, against which its surfaces are fused, and the drift, a random walk, which outlasts the frame.
// Residuals count by their information about the last drift; an outlier counts as if it were at outlier_sigmas.
class MapDrift {
 public:
  struct Params {
    double bound_sigmas = 3.0;
    double walk_m_per_sqrt_s = 0.0015;
    // What is common to a frame and gone in the next: of the depth image, of the pose at the exposure. With it and the
    // walk, half of a step in the pose's odometry is in the drift after 13 frames.
    double frame_sigma_m = 0.005;
    // From the start the jitter of the poses averages out in the map; fused against the offsets of the frames
    // themselves, it would keep that of the first few.
    double settle_s = 1.5;
    double outlier_sigmas = 3.0;

    static void visit(auto& p, auto& field) {
      field("bound_sigmas", p.bound_sigmas, 0.1, 20.0,
            "What lies farther off, in sigmas of the pose along each axis, is no drift.");
      field("walk_m_per_sqrt_s", p.walk_m_per_sqrt_s, 1e-5, 0.1,
            "The drift walks like this while the pose's sigma does not grow, that of what is out of view too.");
      field("frame_sigma_m", p.frame_sigma_m, 1e-5, 0.1,
            "Error of one frame that is gone in the next: of the depth image, of the pose at the exposure.");
      field("settle_s", p.settle_s, 0.0, 60.0,
            "Nothing drifts for so long from the start, while the jitter of the poses averages out in the map.");
      field("outlier_sigmas", p.outlier_sigmas, 0.5, 20.0,
            "A residual farther out counts as if it were as far (Huber).");
    }
  };

  MapDrift() noexcept : MapDrift(Params{}) {}
  explicit MapDrift(const Params& params) noexcept : params_(params) {}

  // The map begins anew, in the pose's odometry.
  void clear() noexcept { *this = MapDrift(params_); }
  void begin_frame(std::int64_t stamp_ns, double position_sigma_m) noexcept;
  // innovation_m: by how much the surface lies further along the direction, a unit vector, than the map and the
  // last drift say.
  void add(const Vec3& direction, double innovation_m, double variance_m2) noexcept;
  void end_frame() noexcept;

  // False: the pose claims to be exact, and its word stands.
  [[nodiscard]] bool possible() const noexcept { return sigma_m_ > 0.0; }
  // What lies at p in the map lies at p + drift in the pose's odometry.
  [[nodiscard]] const Vec3& drift_m() const noexcept { return drift_m_; }
  // The same for this frame alone, once the map has settled.
  [[nodiscard]] const Vec3& frame_offset_m() const noexcept { return frame_offset_m_; }

 private:
  Params params_;
  Vec3 drift_m_ = Vec3::Zero();
  Mat3 covariance_m2_ = Mat3::Zero();
  Vec3 frame_offset_m_ = Vec3::Zero();
  Mat3 information_ = Mat3::Zero();  // of this frame's residuals about the last drift
  Vec3 gradient_ = Vec3::Zero();
  double sigma_m_ = 0.0;  // of the pose
  std::int64_t first_ns_ = -1;
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
