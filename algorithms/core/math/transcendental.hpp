// SPDX-License-Identifier: Apache-2.0
// The transcendental functions of the module: they use nothing but IEEE 754's exact operations in a fixed order, so
// that every target gives the same bits (of a NaN no more than that it is one).
// tests/algorithms/core/transcendental_test.cpp states how accurate they are. Coefficients are fdlibm's (Sun
// Microsystems, 1993).
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "algorithms/core/math/quarter_turns.hpp"

namespace polygmap::math {

struct SinCos {
  double sin;
  double cos;
};

namespace internal {

inline constexpr double kRound = 0x1.8p52;  // the last bits of a sum with it are the nearest whole number
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Four or two numbers in vector registers, as wide as the processor has them: every operation is that of each number.
template <std::size_t kWidth>
struct Lanes;
template <>
struct Lanes<4> {
  typedef double Reals __attribute__((vector_size(32)));
  typedef std::uint64_t Bits __attribute__((vector_size(32)));
};
template <>
struct Lanes<2> {
  typedef double Reals __attribute__((vector_size(16)));
  typedef std::uint64_t Bits __attribute__((vector_size(16)));
};

// r_rad: what is left of an angle of less than kLarge_rad; shifted: its lowest bits count the quarter turns.
inline constexpr double kLarge_rad = 1e5;
template <typename Real>
[[gnu::always_inline]] inline void take_quarter_turns(const Real& x_rad, Real& shifted, Real& r_rad) noexcept {
  constexpr double kPart1 = 1.57079632673412561417e+00, kPart2 = 6.07710050630396597660e-11,
                   kPart3 = 2.02226624879595063154e-21;
  shifted = x_rad * 6.36619772367581382433e-01 + kRound;
  const Real quarters = shifted - kRound;
  r_rad = x_rad - quarters * kPart1 - quarters * kPart2 - quarters * kPart3;
}

// Sine and cosine of what is within pi/4.
template <typename Real>
[[gnu::always_inline]] inline void sin_cos_of_rest(const Real& r_rad, Real& sin, Real& cos) noexcept {
  const Real z = r_rad * r_rad, half = 0.5 * z, w = 1.0 - half;
  Real s = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10;
  s = 2.75573137070700676789e-06 + z * s;
  s = -1.98412698298579493134e-04 + z * s;
  s = 8.33333333332248946124e-03 + z * s;
  s = -1.66666666666666324348e-01 + z * s;
  sin = r_rad + r_rad * z * s;
  Real c = 2.08757232129817482790e-09 - z * 1.13596475577881948265e-11;
  c = -2.75573143513906633035e-07 + z * c;
  c = 2.48015872894767294178e-05 + z * c;
  c = -1.38888888888741095749e-03 + z * c;
  c = 4.16666666666666019037e-02 + z * c;
  cos = w + ((1.0 - w - half) + z * z * c);
}

[[nodiscard]] inline SinCos turned(double s, double c, std::uint64_t quarter) noexcept {
  const bool odd = (quarter & 1U) != 0;
  const double sin = odd ? c : s, cos = odd ? s : c;
  return {(quarter & 2U) != 0 ? -sin : sin, ((quarter + 1U) & 2U) != 0 ? -cos : cos};
}

// Of kWidth angles of less than kLarge_rad.
template <std::size_t kWidth>
inline void sin_cos_of_lanes(const double* x_rad, double* sin, double* cos) noexcept {
  using Reals = typename Lanes<kWidth>::Reals;
  using Bits = typename Lanes<kWidth>::Bits;
  Reals x, shifted, rest, s, c;
  std::memcpy(&x, x_rad, sizeof(x));
  take_quarter_turns(x, shifted, rest);
  sin_cos_of_rest(rest, s, c);
  Bits quarter, s_bits, c_bits;
  std::memcpy(&quarter, &shifted, sizeof(quarter));
  std::memcpy(&s_bits, &s, sizeof(s));
  std::memcpy(&c_bits, &c, sizeof(c));
  const Bits swapped = (s_bits ^ c_bits) & (0U - (quarter & 1U));
  s_bits ^= swapped ^ (quarter & 2U) << 62U;
  c_bits ^= swapped ^ ((quarter + 1U) & 2U) << 62U;
  std::memcpy(sin, &s_bits, sizeof(s_bits));
  std::memcpy(cos, &c_bits, sizeof(c_bits));
}

[[nodiscard, gnu::cold, gnu::noinline]] inline SinCos sin_cos_of_large(double x_rad) noexcept {
  if (!(std::abs(x_rad) <= std::numeric_limits<double>::max())) return {kNan, kNan};
  const QuarterTurns turns = quarter_turns_of_large(x_rad);
  double s = 0.0, c = 0.0;
  sin_cos_of_rest(turns.rest_rad, s, c);
  return turned(s, c, turns.quarter);
}

// Of finite y and x, the larger of which is far from overflow and underflow. atan(t) = atan(c) + atan((t-c)/(1+ct)) for
// c of 0, 1/2 or 1, whichever is nearest, in the eighth of a turn where t is at most 1.
[[nodiscard]] inline double atan2_in_range(double y, double x) noexcept {
  struct Piece {
    double a, b;  // (a t - b) / (a + b t)
  };
  static constexpr std::array<Piece, 3> kPieces = {{{1.0, 0.0}, {2.0, 1.0}, {1.0, 1.0}}};
  struct Base {
    double high_rad, low_rad, sign;
  };
  // atan(c) as it is turned by steep and left, in two parts.
  static constexpr std::array<Base, 12> kBases = {{{0.0, 0.0, 1.0},
                                                   {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56, 1.0},
                                                   {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55, 1.0},
                                                   {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54, -1.0},
                                                   {0x1.1b6e192ebbe44p+0, 0x1.b1b466a88828ep-54, -1.0},
                                                   {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55, -1.0},
                                                   {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53, -1.0},
                                                   {0x1.56c6e7397f5aep+1, 0x1.660b64ece6f4bp-53, -1.0},
                                                   {0x1.2d97c7f3321d2p+1, 0x1.a79394c9e8a0ap-54, -1.0},
                                                   {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54, 1.0},
                                                   {0x1.0468a8ace4df6p+1, 0x1.0620bf7406affp-55, 1.0},
                                                   {0x1.2d97c7f3321d2p+1, 0x1.a79394c9e8a0ap-54, 1.0}}};
  const double width = std::abs(x), height = std::abs(y);
  const bool steep = height > width;
  const double longer = steep ? height : width, shorter = steep ? width : height;
  const std::size_t piece = std::size_t{16.0 * shorter > 7.0 * longer} + std::size_t{16.0 * shorter > 11.0 * longer};
  const auto [a, b] = kPieces[piece];
  const double t = (a * shorter - b * longer) / (a * longer + b * shorter);
  const double z = t * t, w = z * z;
  double even = -3.65315727442169155270e-02 * w - 5.83357013379057348645e-02;
  even = even * w - 7.69187620504482999495e-02;
  even = even * w - 1.11111104054623557880e-01;
  even = even * w - 1.99999999998764832476e-01;
  double odd = 1.62858201153657823623e-02 * w + 4.97687799461593236017e-02;
  odd = odd * w + 6.66107313738753120669e-02;
  odd = odd * w + 9.09088713343650656196e-02;
  odd = odd * w + 1.42857142725034663711e-01;
  odd = odd * w + 3.33333333333329318027e-01;
  const double atan_rad = t - t * (z * odd + w * even);
  const Base& base = kBases[piece + (steep ? 3U : 0U) + (x < 0.0 ? 6U : 0U)];
  return std::copysign(base.high_rad + (base.low_rad + base.sign * atan_rad), y);
}

[[nodiscard, gnu::cold, gnu::noinline]] inline double atan2_at_limits(double y, double x) noexcept {
  if (std::isnan(x) || std::isnan(y)) return kNan;
  const auto scaled = [](double v, double by) noexcept { return v * by; };
  const double larger = std::abs(x) > std::abs(y) ? std::abs(x) : std::abs(y);
  if (larger == 0.0) return atan2_in_range(y, std::copysign(1.0, x));
  if (std::isinf(larger)) {
    const auto unit = [](double v) noexcept { return std::copysign(std::isinf(v) ? 1.0 : 0.0, v); };
    return atan2_in_range(unit(y), unit(x));
  }
  const double by = larger > 1.0 ? 0x1p-600 : 0x1p600;
  return atan2_in_range(scaled(y, by), scaled(x, by));
}

}  // namespace internal

// Sine and cosine at once. Below 1e5 rad by reduction in three parts of pi/2. Of a zero with a sign the sine is +0.
[[nodiscard]] inline SinCos sin_cos(double x_rad) noexcept {
  if (!(std::abs(x_rad) < internal::kLarge_rad)) return internal::sin_cos_of_large(x_rad);
  double shifted = 0.0, rest_rad = 0.0, s = 0.0, c = 0.0;
  internal::take_quarter_turns(x_rad, shifted, rest_rad);
  internal::sin_cos_of_rest(rest_rad, s, c);
  return internal::turned(s, c, std::bit_cast<std::uint64_t>(shifted));
}

template <std::size_t kCount>
struct SinCosOf {
  std::array<double, kCount> sin;
  std::array<double, kCount> cos;
};
namespace internal {
template <std::size_t kCount>
[[gnu::cold, gnu::noinline]] inline void sin_cos_one_by_one(const double* x_rad, SinCosOf<kCount>& out) noexcept {
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto [s, c] = sin_cos(x_rad[i]);
    out.sin[i] = s;
    out.cos[i] = c;
  }
}
}  // namespace internal
// Of several angles, an even number: the same bits for fewer instructions.
template <std::size_t kCount>
[[nodiscard]] inline SinCosOf<kCount> sin_cos(const std::array<double, kCount>& x_rad) noexcept {
  static_assert(kCount % 2 == 0);
  SinCosOf<kCount> out;
  bool small = true;
  for (const double x : x_rad) small = small && std::abs(x) < internal::kLarge_rad;
  if (!small) {
    internal::sin_cos_one_by_one(x_rad.data(), out);
    return out;
  }
  std::size_t i = 0;
  for (; i + 4 <= kCount; i += 4) internal::sin_cos_of_lanes<4>(&x_rad[i], &out.sin[i], &out.cos[i]);
  for (; i < kCount; i += 2) internal::sin_cos_of_lanes<2>(&x_rad[i], &out.sin[i], &out.cos[i]);
  return out;
}
[[nodiscard]] inline double sin(double x_rad) noexcept { return sin_cos(x_rad).sin; }
[[nodiscard]] inline double cos(double x_rad) noexcept { return sin_cos(x_rad).cos; }

// In [-pi, pi] as the C library has it, zeros and infinities included.
[[nodiscard]] inline double atan2(double y, double x) noexcept {
  const double larger = std::abs(x) > std::abs(y) ? std::abs(x) : std::abs(y);
  if (!(larger > 0x1p-900 && larger < 0x1p900)) return internal::atan2_at_limits(y, x);
  return internal::atan2_in_range(y, x);
}
// NaN outside [-1, 1].
[[nodiscard]] inline double asin(double x) noexcept { return atan2(x, std::sqrt((1.0 - x) * (1.0 + x))); }
[[nodiscard]] inline double acos(double x) noexcept { return atan2(std::sqrt((1.0 - x) * (1.0 + x)), x); }

[[nodiscard]] inline double exp(double x) noexcept {
  if (!(x > -745.2 && x < 709.8)) {
    return std::isnan(x) ? internal::kNan : (x > 0.0 ? std::numeric_limits<double>::infinity() : 0.0);
  }
  const double shifted = x * 1.44269504088896338700e+00 + internal::kRound, twos = shifted - internal::kRound;
  const double high = x - twos * 6.93147180369123816490e-01, low = twos * 1.90821492927058770002e-10;
  const double r = high - low, z = r * r;
  double c = -1.65339022054652515390e-06 + z * 4.13813679705723846039e-08;
  c = 6.61375632143793436117e-05 + z * c;
  c = -2.77777777770155933842e-03 + z * c;
  c = 1.66666666666666019037e-01 + z * c;
  c = r - z * c;
  const double of_rest = 1.0 - ((low - (r * c) / (2.0 - c)) - high);
  // Twice, so that a result below the normal numbers is rounded once and one next to the largest is not lost.
  const auto power = static_cast<std::int32_t>(std::bit_cast<std::uint64_t>(shifted));
  const auto two_to = [](std::int32_t n) noexcept {
    return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + n) << 52U);
  };
  const std::int32_t half = power / 2;
  return of_rest * two_to(half) * two_to(power - half);
}

}  // namespace polygmap::math
