// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/camera/depth_holes.hpp"

#include <algorithm>
#include <cmath>

namespace polygmap::sim {

DepthHoles::DepthHoles(const CameraErrors& errors, const StairWorld& world, std::uint64_t seed)
    : errors_(errors), half_width_m_(world.half_width_m), noise_(seed, Stream::kTreadHoles) {
  constexpr double kLevel_m = 0.003, kTurned_m = 0.3;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const Step& step = world.steps[k];
    treads_.push_back({step.true_T_step.inverse(), step, noise_.uniform(k) < errors.hole_treads,
                       step.turned() ? kTurned_m : step.worn_m + kLevel_m});
  }
  if (treads_.empty()) return;
  // On one of the treads that the robot sees from the floor.
  const CounterNoise sun(seed, Stream::kSunPatch);
  constexpr std::uint64_t kLower = 4;
  const Step& lit = treads_[sun.bits(0) % std::min<std::uint64_t>(kLower, treads_.size())].step;
  sun_place_m_ = {sun.uniform(1, lit.nosing_x_m, lit.back_x_m), sun.uniform(2, -0.25, 0.25), lit.height_m};
  sun_ray_ = Vec3{sun.uniform(3, -0.6, 0.6), sun.uniform(4, -0.6, 0.6), 1.0}.normalized();
}

bool DepthHoles::is_sunlit(const Vec3& point_m) const {
  return (point_m - sun_place_m_).cross(sun_ray_).norm() < errors_.sun_patch_m;
}

bool DepthHoles::is_lost(const Tread& tread, const Vec3& step_p_m, std::uint64_t frame, int u, int v) const {
  const bool on_strip = step_p_m.x() < tread.step.edge_x_m() + errors_.nosing_strip_m;
  if (on_strip && errors_.nosing_strip_m > 0.0) return true;
  if (!tread.holed) return false;
  const auto drawn = [this](std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    return noise_.uniform(mix64(mix64(mix64(a + 1) ^ b) ^ c));
  };
  constexpr int kBlob_px = 6;
  constexpr double kBlob_m = 0.03;
  if (drawn(frame, static_cast<std::uint64_t>(u / kBlob_px), static_cast<std::uint64_t>(v / kBlob_px)) <
      errors_.dark_share) {
    return true;
  }
  const auto cell = [](double along_m) { return static_cast<std::uint64_t>(std::llround(along_m / kBlob_m) + 1000); };
  constexpr std::uint64_t kAlways = 1ULL << 40U;  // no frame has that number
  return drawn(kAlways, cell(step_p_m.x()), cell(step_p_m.y())) < errors_.shiny_share;
}

void DepthHoles::apply(const DepthRenderer& picture, const DepthScene& first, const DepthScene& last,
                       std::uint64_t frame, std::uint16_t* depth) const {
  if (std::max({errors_.dark_share, errors_.shiny_share, errors_.nosing_strip_m, errors_.sun_patch_m}) <= 0.0) return;
  const CameraIntrinsics& k = picture.intrinsics();
  const Transform &from = first.true_T_camera, &to = last.true_T_camera;
  for (int v = 0; v < k.height_px; ++v) {
    const double s = picture.moment_of(v);
    const Mat3 R = from.R + s * (to.R - from.R);
    const Vec3 p_m = from.p_m + s * (to.p_m - from.p_m);
    const Vec3 at_zero = R * Vec3{-k.cx_px / k.fx_px, (v - k.cy_px) / k.fy_px, 1.0}, per_px = R.col(0) / k.fx_px;
    const float* inverse_depth = picture.inverse_depth(v);
    for (int u = 0; u < k.width_px; ++u, ++depth) {
      if (*depth == 0 || inverse_depth[u] <= 0.0F) continue;
      const Vec3 point_m = p_m + (at_zero + u * per_px) / static_cast<double>(inverse_depth[u]);
      if (is_sunlit(point_m)) {
        *depth = 0;
        continue;
      }
      for (const Tread& tread : treads_) {
        if (std::abs(point_m.z() - tread.step.height_m) > tread.turned_z_m) continue;
        constexpr double kOn_m = 0.002;
        const Vec3 step_p_m = tread.step_T_true * point_m;
        const double above_m = step_p_m.z() - tread.step.height_m;
        const double round_m = step_p_m.x() < tread.step.edge_x_m() ? tread.step.worn_m : 0.0;
        if (above_m > kOn_m || above_m < -kOn_m - round_m) continue;
        if (step_p_m.x() < tread.step.nosing_x_m - kOn_m || step_p_m.x() > tread.step.back_x_m + tread.step.beneath_m) {
          continue;
        }
        if (std::abs(step_p_m.y()) > half_width_m_) continue;
        if (is_lost(tread, step_p_m, frame, u, v)) *depth = 0;
        break;
      }
    }
  }
}

}  // namespace polygmap::sim
