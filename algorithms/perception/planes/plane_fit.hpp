// SPDX-License-Identifier: Apache-2.0
// Planes in inverse depth: w(ray) = m . ray for the ray (x, y, 1), fitted by weighted least squares.
#pragma once

#include <cstdint>

#include "algorithms/core/math/math.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"

namespace polygmap {

// m = -normal / d for normal . p + d = 0, normal towards the camera, d > 0.
struct InversePlane {
  Vec3 m = Vec3::UnitZ();

  [[nodiscard]] double d_m() const noexcept { return 1.0 / m.norm(); }
  [[nodiscard]] Vec3 normal() const noexcept { return -m / m.norm(); }
  // Coordinate by coordinate: what dot() loads as a vector was mostly just stored as numbers, and waits for them.
  [[nodiscard]] double inverse_depth(const Vec3& ray) const noexcept {
    return m.x() * ray.x() + m.y() * ray.y() + m.z() * ray.z();
  }
  // Where a ray meets the plane; only for rays with inverse_depth > 0.
  [[nodiscard]] Vec3 point(const Vec3& ray) const noexcept { return ray / inverse_depth(ray); }
  // Signed distance of a point, positive on the camera's side.
  [[nodiscard]] double distance_m(const Vec3& point_m) const noexcept { return (1.0 - m.dot(point_m)) * d_m(); }
};

// 1/m: planes farther than 20 m, beyond every depth camera, are none.
inline constexpr double kLeastInverseDepth = 0.05;

// Weighted moments of samples: sum of g ray ray^T and g ray w, enough for a fit, and they add.
struct PlaneMoments {
  double xx = 0, xy = 0, x1 = 0, yy = 0, y1 = 0, one = 0;  // of g ray ray^T
  double xw = 0, yw = 0, w1 = 0;                           // of g ray w
  double count = 0;

  void add(double g, double x, double y, double w) noexcept {
    xx += g * x * x, xy += g * x * y, x1 += g * x, yy += g * y * y, y1 += g * y, one += g;
    xw += g * x * w, yw += g * y * w, w1 += g * w;
    count += 1.0;
  }
  void add(const PlaneMoments& o) noexcept {
    xx += o.xx, xy += o.xy, x1 += o.x1, yy += o.yy, y1 += o.y1, one += o.one;
    xw += o.xw, yw += o.yw, w1 += o.w1;
    count += o.count;
  }
  // These of samples in a frame of their own, at y and w: of the same ones at y0 + pitch y, and w + plane . (x, y, 1).
  [[nodiscard]] PlaneMoments moved(double y0, double pitch, const Vec3& plane) const noexcept {
    PlaneMoments to;
    to.xx = xx, to.xy = y0 * x1 + pitch * xy, to.x1 = x1, to.one = one, to.y1 = y0 * one + pitch * y1;
    to.yy = y0 * to.y1 + pitch * (y0 * y1 + pitch * yy);
    to.w1 = w1 + plane.x() * x1 + plane.z() * one + plane.y() * y1;
    to.xw = xw + plane.x() * xx + plane.z() * x1 + plane.y() * xy;
    to.yw = y0 * to.w1 + pitch * (yw + plane.x() * xy + plane.z() * y1 + plane.y() * yy);
    to.count = count;
    return to;
  }
  [[nodiscard]] Mat3 matrix() const noexcept { return (Mat3() << xx, xy, x1, xy, yy, y1, x1, y1, one).finished(); }
  [[nodiscard]] Vec3 vector() const noexcept { return {xw, yw, w1}; }
  [[nodiscard]] Vec3 mean_ray() const noexcept { return {x1 / one, y1 / one, 1.0}; }
};

// What gravity says about a plane before it is measured.
enum class Lean : std::uint8_t { kAny, kLevel, kUpright };

struct PlaneFit {
  struct Params {
    double lean_sigma_rad = 0.006;
    double lean_tilt_rad = 0.5;
    double lean_sigmas = 3.0;

    static void visit(auto& p, auto& field) {
      field("lean_sigma_rad", p.lean_sigma_rad, 1e-4, 1.0,
            "Treads are as level and risers as upright, the estimator's up included.");
      field("lean_tilt_rad", p.lean_tilt_rad, 0.01, 1.5, "A plane farther from level or upright is neither.");
      field("lean_sigmas", p.lean_sigmas, 0.1, 20.0,
            "A plane whose pixels contradict level or upright by as many sigmas is neither.");
    }
  };
};

// Standard deviation of the plane's place along its normal where a ray meets it; covariance is that of m.
[[nodiscard]] double plane_sigma_m(const InversePlane& plane, const Mat3& covariance, const Vec3& ray) noexcept;

// Weighted least squares of moments whose weights were 1 / sigma^2, with the lean as a prior. False when the moments do
// not fix a plane in front of the camera. covariance (of m) is optional.
[[nodiscard]] bool try_solve(const PlaneFit::Params& params, const DepthNoiseModel& noise, const PlaneMoments& moments,
                             Lean lean, const Vec3& up, InversePlane& plane, Mat3* covariance) noexcept;

// The same with the lean that lies nearest, unless the pixels contradict it: few pixels say little about a plane's
// lean.
[[nodiscard]] bool try_solve_leaning(const PlaneFit::Params& params, const DepthNoiseModel& noise,
                                     const PlaneMoments& moments, const Vec3& up, InversePlane& plane,
                                     Mat3* covariance) noexcept;

}  // namespace polygmap
