// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/plane_ransac.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "algorithms/perception/polygons/counter_random.hpp"

namespace polygmap {
namespace {

constexpr double kMinInverseDepth = 0.05;   // 20 m
constexpr double kLevelTiltMax_rad = 0.35;  // a draw that leans more than this from its class is no candidate

// Whether a candidate agrees with what its region is known to be.
bool agrees(const InversePlane& plane, Lean lean, const Vec3& up) noexcept {
  const double c = plane.normal().dot(up);
  if (lean == Lean::kLevel) return c > math::cos(kLevelTiltMax_rad);
  if (lean == Lean::kUpright) return std::abs(c) < math::sin(kLevelTiltMax_rad);
  return true;
}

// |w - predicted| against the tolerance, without a division per sample: both times w; cos(incidence) = w d / |ray|.
struct Gate {
  DepthNoiseModel noise;
  double floor, k, inverse_d;
  [[nodiscard]] bool inside(double residual, double w, double ray_norm) const noexcept {
    const double sigma = noise.inverse_sigma(w) * ray_norm * inverse_d;
    return std::abs(residual) * w < k * sigma + floor * w * w * w;
  }
};

Gate gate_of(const PlaneRansac::Params& params, const DepthNoiseModel& noise, const InversePlane& plane) noexcept {
  return {noise, params.inlier_floor_m, params.inlier_sigmas, plane.m.norm()};
}

}  // namespace

double inverse_depth_sigma(const DepthNoiseModel& noise, const InversePlane& plane, const Vec3& ray) noexcept {
  const double w = std::max(plane.inverse_depth(ray), kMinInverseDepth);
  return noise.inverse_sigma(w) / w * ray.norm() * plane.m.norm();
}

void PlaneRansac::begin(std::uint32_t seed, std::span<const PlaneSample> samples) noexcept {
  samples_ = samples;
  seed_ = seed;
  trial_ = 0;
  best_inliers_ = 0;
}

bool PlaneRansac::step(const Params& params, const DepthNoiseModel& noise, Lean lean, const Vec3& up) noexcept {
  const auto n = static_cast<std::uint32_t>(samples_.size());
  if (n < 3) return true;
  const std::int32_t trial = trial_++;
  const bool last = trial_ >= params.trials;
  Mat3 rays;
  Vec3 w;
  for (int k = 0; k < 3; ++k) {
    const auto counter = static_cast<std::uint32_t>(trial) * 3U + static_cast<std::uint32_t>(k);
    const PlaneSample& s = samples_[counter_random(seed_, counter) % n];
    rays.row(k) << static_cast<double>(s.x), static_cast<double>(s.y), 1.0;
    w[k] = static_cast<double>(s.w);
  }
  const double determinant = rays.determinant();
  if (!(std::abs(determinant) > 1e-5)) return last;  // nearly on a line, or the same pixel twice
  InversePlane candidate{rays.inverse() * w};
  if (lean == Lean::kLevel && trial % 2 == 0) {
    // Three pixels of a strip say little about its tilt: every other draw keeps their distance and gravity's tilt.
    const Vec3 centre = rays.colwise().mean().transpose();
    if (!(centre.dot(up) < -1e-3)) return last;
    candidate.m = up * (w.mean() / centre.dot(up));
  }
  if (!math::all_finite(candidate.m) || !(candidate.m.norm() > kMinInverseDepth) || !agrees(candidate, lean, up)) {
    return last;
  }
  const Gate gate = gate_of(params, noise, candidate);
  std::int32_t inliers = 0;
  for (const PlaneSample& s : samples_) {
    const double x = static_cast<double>(s.x), y = static_cast<double>(s.y), ws = static_cast<double>(s.w);
    const double residual = ws - (candidate.m.x() * x + candidate.m.y() * y + candidate.m.z());
    inliers += gate.inside(residual, ws, math::sqrt(x * x + y * y + 1.0)) ? 1 : 0;
  }
  if (inliers > best_inliers_) {
    best_inliers_ = inliers;
    best_ = candidate;
  }
  return last || best_inliers_ >= static_cast<std::int32_t>(params.enough_inliers * n);
}

bool PlaneRansac::try_finish(const Params& params, const DepthNoiseModel& noise, Lean lean, const Vec3& up,
                             InversePlane& plane, std::int32_t& inliers) const noexcept {
  if (best_inliers_ < 3) return false;
  plane = best_;
  for (int round = 0; round < 3; ++round) {
    PlaneMoments moments;
    const Gate gate = gate_of(params, noise, plane);
    inliers = 0;
    for (const PlaneSample& s : samples_) {
      const Vec3 ray{static_cast<double>(s.x), static_cast<double>(s.y), 1.0};
      const double w = static_cast<double>(s.w);
      if (!gate.inside(w - plane.inverse_depth(ray), w, ray.norm())) continue;
      moments.add(1.0 / math::square(inverse_depth_sigma(noise, plane, ray)), ray.x(), ray.y(), w);
      ++inliers;
    }
    if (!try_solve(params.fit, noise, moments, lean, up, plane, nullptr)) return false;
  }
  return agrees(plane, lean, up);
}

}  // namespace polygmap
