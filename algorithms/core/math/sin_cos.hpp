// SPDX-License-Identifier: Apache-2.0
// Sine and cosine at once, for the many frames that the gait turns in a tick: cheaper than the C library's. To the last
// bit but one, and the same bits on every target.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "algorithms/core/math/math.hpp"

namespace polygmap::math {

struct SinCos {
  double sin;
  double cos;
};

// Source: reduction by pi/2 in three parts and minimax polynomials on +-pi/4, with the constants of fdlibm. Beyond
// 1e5 rad, and for what is no number, the C library answers.
[[nodiscard]] inline SinCos sin_cos(double x_rad) noexcept {
  if (!(std::abs(x_rad) < 1e5)) return {sin(x_rad), cos(x_rad)};
  constexpr double kPart1 = 1.57079632673412561417e+00, kPart2 = 6.07710050630396597660e-11,
                   kPart3 = 2.02226624879595063154e-21;
  constexpr double kRound = 0x1.8p52;  // the last bits of a sum with it are the nearest whole number
  const double shifted = x_rad * (2.0 / kPi) + kRound, quarters = shifted - kRound;
  const double r = x_rad - quarters * kPart1 - quarters * kPart2 - quarters * kPart3;
  const double z = r * r, half = 0.5 * z, w = 1.0 - half;

  double s = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10;
  s = 2.75573137070700676789e-06 + z * s;
  s = -1.98412698298579493134e-04 + z * s;
  s = 8.33333333332248946124e-03 + z * s;
  s = -1.66666666666666324348e-01 + z * s;
  s = r + r * z * s;
  double c = 2.08757232129817482790e-09 - z * 1.13596475577881948265e-11;
  c = -2.75573143513906633035e-07 + z * c;
  c = 2.48015872894767294178e-05 + z * c;
  c = -1.38888888888741095749e-03 + z * c;
  c = 4.16666666666666019037e-02 + z * c;
  c = w + ((1.0 - w - half) + z * z * c);

  const auto quarter = std::bit_cast<std::uint64_t>(shifted);
  const bool odd = (quarter & 1U) != 0;
  const double sin = odd ? c : s, cos = odd ? s : c;
  return {(quarter & 2U) != 0 ? -sin : sin, ((quarter + 1U) & 2U) != 0 ? -cos : cos};
}

}  // namespace polygmap::math
