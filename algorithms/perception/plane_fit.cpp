// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/plane_fit.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

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
  DepthSigma noise;
  double floor, k, inverse_d;
  [[nodiscard]] bool inside(double residual, double w, double ray_norm) const noexcept {
    const double sigma = noise.inverse_sigma(w) * ray_norm * inverse_d;
    return std::abs(residual) * w < k * sigma + floor * w * w * w;
  }
};

Gate gate_of(const PlaneFit::Params& params, const DepthSigma& noise, const InversePlane& plane) noexcept {
  return {noise, params.inlier_floor_m, params.inlier_sigmas, plane.m.norm()};
}

}  // namespace

double inverse_depth_sigma(const DepthSigma& noise, const InversePlane& plane, const Vec3& ray) noexcept {
  const double w = std::max(plane.inverse_depth(ray), kMinInverseDepth);
  return noise.inverse_sigma(w) / w * ray.norm() * plane.m.norm();
}

double plane_sigma_m(const InversePlane& plane, const Mat3& covariance, const Vec3& ray) noexcept {
  // The plane's distance at a fixed depth z moves by d z (ray . dm).
  const double w = std::max(plane.inverse_depth(ray), kMinInverseDepth);
  return plane.d_m() / w * math::sqrt(std::max(ray.dot(covariance * ray), 0.0));
}

bool try_solve(const PlaneFit::Params& params, const DepthSigma& noise, const PlaneMoments& moments, Lean lean,
               const Vec3& up, InversePlane& plane, Mat3* covariance) noexcept {
  if (!(moments.one > 0.0)) return false;
  const double belief = 1.0 / std::max(noise.correlated_px, 1.0);
  Mat3 a = moments.matrix() * belief;
  const Vec3 b = moments.vector() * belief;
  if (lean != Lean::kAny) {
    // m . e ~ N(0, |m| lean_sigma) for directions e that a plane of this lean has no normal in. |m| from the mean ray.
    const double w_mean = moments.w1 / moments.one;
    const Vec3 ray = moments.mean_ray();
    double norm = w_mean / ray.norm();
    Mat3 across = Mat3::Identity() - up * up.transpose();
    if (lean == Lean::kLevel) {
      norm = w_mean / std::max(std::abs(ray.dot(up)), 0.05);
    } else {
      across = up * up.transpose();
      norm = w_mean / std::max((ray - up * ray.dot(up)).norm(), 0.05);
    }
    a += across / math::square(std::max(params.lean_sigma_rad, 1e-4) * norm);
  }
  const double scale = a.trace();
  if (!(scale > 0.0) || !std::isfinite(scale)) return false;
  const double determinant = (a / scale).determinant();
  if (!(determinant > 1e-13)) return false;
  const Mat3 inverse = (a / scale).inverse() / scale;
  const Vec3 m = inverse * b;
  if (!math::all_finite(m) || !(m.norm() > kMinInverseDepth) || !(m.dot(moments.mean_ray()) > kMinInverseDepth)) {
    return false;
  }
  plane.m = m;
  if (covariance != nullptr) *covariance = inverse;
  return true;
}

bool try_solve_leaning(const PlaneFit::Params& params, const DepthSigma& noise, const PlaneMoments& moments,
                       const Vec3& up, InversePlane& plane, Mat3* covariance) noexcept {
  InversePlane free;
  if (!try_solve(params, noise, moments, Lean::kAny, up, free, covariance)) return false;
  plane = free;
  const double c = free.normal().dot(up), most = math::sin(params.lean_tilt_rad);
  const Lean lean =
      c > math::cos(params.lean_tilt_rad) ? Lean::kLevel : (std::abs(c) < most ? Lean::kUpright : Lean::kAny);
  InversePlane leaning;
  Mat3 leaning_covariance;
  if (lean == Lean::kAny || !try_solve(params, noise, moments, lean, up, leaning, &leaning_covariance)) return true;
  const Vec3 off = leaning.m - free.m;
  const double contradiction = off.dot(moments.matrix() * off) / std::max(noise.correlated_px, 1.0);
  if (contradiction > math::square(params.lean_sigmas)) return true;
  plane = leaning;
  if (covariance != nullptr) *covariance = leaning_covariance;
  return true;
}

void PlaneRansac::begin(std::uint32_t seed, std::span<const PlaneSample> samples) noexcept {
  samples_ = samples;
  seed_ = seed;
  trial_ = 0;
  best_inliers_ = 0;
}

bool PlaneRansac::step(const PlaneFit::Params& params, const DepthSigma& noise, Lean lean, const Vec3& up) noexcept {
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

bool PlaneRansac::try_finish(const PlaneFit::Params& params, const DepthSigma& noise, Lean lean, const Vec3& up,
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
    if (!try_solve(params, noise, moments, lean, up, plane, nullptr)) return false;
  }
  return agrees(plane, lean, up);
}

}  // namespace polygmap
