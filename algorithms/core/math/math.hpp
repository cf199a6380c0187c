// SPDX-License-Identifier: Apache-2.0
// Linear algebra types and the scalar functions of the cycle. Transcendental functions are the module's own
// (transcendental.hpp): the C library's round the last bits differently on another target.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>  // cross products
#include <cmath>
#include <numbers>

#include "algorithms/core/math/transcendental.hpp"

namespace polygmap {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat2 = Eigen::Matrix2d;
using Mat3 = Eigen::Matrix3d;

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kGravity_mps2 = 9.81;

namespace math {

[[nodiscard]] inline double sqrt(double x) noexcept { return std::sqrt(x); }  // exact under IEEE 754
[[nodiscard]] inline float sqrt(float x) noexcept { return std::sqrt(x); }

// The equivalent angle in (-pi, pi]; a non-finite or huge angle (over 1e6 rad) gives 0.
[[nodiscard]] inline double wrap_angle(double angle_rad) noexcept {
  if (!(std::abs(angle_rad) < 1e6)) return 0.0;
  const double turns = std::ceil((angle_rad - kPi) / (2.0 * kPi));
  const double wrapped_rad = angle_rad - 2.0 * kPi * turns;
  // The quotient is rounded: next to a half turn the remainder may miss the interval by a rounding error.
  return wrapped_rad > kPi ? wrapped_rad - 2.0 * kPi : (wrapped_rad <= -kPi ? wrapped_rad + 2.0 * kPi : wrapped_rad);
}

template <typename T>
[[nodiscard]] constexpr T square(T x) noexcept {
  return x * x;
}

// NaN becomes low: a bad number never leaves a limit.
[[nodiscard]] constexpr double clamp(double x, double low, double high) noexcept {
  return x > high ? high : (x > low ? x : low);
}

template <typename Derived>
[[nodiscard]] bool all_finite(const Eigen::DenseBase<Derived>& m) noexcept {
  for (Eigen::Index c = 0; c < m.cols(); ++c) {
    for (Eigen::Index r = 0; r < m.rows(); ++r) {
      if (!std::isfinite(m.derived().coeff(r, c))) return false;
    }
  }
  return true;
}

}  // namespace math
}  // namespace polygmap
