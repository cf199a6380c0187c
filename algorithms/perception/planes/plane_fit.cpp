// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/plane_fit.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace polygmap {

double plane_sigma_m(const InversePlane& plane, const Mat3& covariance, const Vec3& ray) noexcept {
  // The plane's distance at a fixed depth z moves by d z (ray . dm).
  const double w = std::max(plane.inverse_depth(ray), kLeastInverseDepth);
  return plane.d_m() / w * math::sqrt(std::max(ray.dot(covariance * ray), 0.0));
}

bool try_solve(const PlaneFit::Params& params, const DepthNoiseModel& noise, const PlaneMoments& moments, Lean lean,
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
  if (!math::all_finite(m) || !(m.norm() > kLeastInverseDepth) || !(m.dot(moments.mean_ray()) > kLeastInverseDepth)) {
    return false;
  }
  plane.m = m;
  if (covariance != nullptr) *covariance = inverse;
  return true;
}

bool try_solve_leaning(const PlaneFit::Params& params, const DepthNoiseModel& noise, const PlaneMoments& moments,
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

}  // namespace polygmap
