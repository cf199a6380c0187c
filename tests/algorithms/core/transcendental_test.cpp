// SPDX-License-Identifier: Apache-2.0
// How accurate the module's transcendental functions are, in units in the last place (ulp) of the true result, and that
// every target gives the same bits. The reference is the C library's long double: 64 bits on x86, 113 on AArch64.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "algorithms/core/math/math.hpp"
#include "tests/support/bit_hash.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();
constexpr double kMost = std::numeric_limits<double>::max();

// SplitMix64: the same arguments on every target.
class Arguments {
 public:
  [[nodiscard]] double any_bits() { return std::bit_cast<double>(next()); }
  [[nodiscard]] double within(double most) {
    return most * (static_cast<double>(static_cast<std::int64_t>(next() >> 11U)) * 0x1p-52 - 1.0);
  }
  // Any magnitude from 2^-exponents to 2^exponents is as likely.
  [[nodiscard]] double of_any_size(int exponents) {
    const auto exponent = static_cast<int>(next() % (2U * static_cast<unsigned>(exponents))) - exponents;
    return std::ldexp(within(1.0), exponent);
  }

 private:
  [[nodiscard]] std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ z >> 30U) * 0xBF58476D1CE4E5B9U;
    z = (z ^ z >> 27U) * 0x94D049BB133111EBU;
    return z ^ z >> 31U;
  }
  std::uint64_t state_ = 7;
};

double error_ulp(double got, long double wanted) {
  if (std::isnan(wanted)) return std::isnan(got) ? 0.0 : kInf;
  if (got == static_cast<double>(wanted)) return 0.0;
  if (!std::isfinite(got) || std::isinf(static_cast<double>(wanted))) return kInf;
  int exponent = 0;
  (void)std::frexp(wanted, &exponent);
  return static_cast<double>(std::abs(got - wanted) / std::ldexp(1.0L, std::max(exponent, -1021) - 53));
}

const std::vector<double>& hard_arguments() {
  static const std::vector<double> all = [] {
    std::vector<double> out;
    for (const double x : {0.0,
                           kLeast,
                           3 * kLeast,
                           0x1p-1022,
                           0x1.fffffffffffffp-1023,
                           1e-300,
                           0x1p-600,
                           1e-17,
                           1e-9,
                           0.4375,
                           0.5,
                           0.6875,
                           0.975,
                           1.0,
                           1.5,
                           kPi / 4,
                           kPi / 2,
                           kPi,
                           2 * kPi,
                           1e4,
                           99999.9,
                           1e5,
                           1e6,
                           708.3,
                           709.78271289338397,
                           709.782712893384,
                           744.44007192138122,
                           745.13321910194122,
                           745.2,
                           0x1p15,
                           0x1p52,
                           0x1p53,
                           1e22,
                           0x1.6ac5b262ca1ffp+849,
                           0x1p900,
                           0x1p1000,
                           kMost,
                           kInf,
                           kNan}) {
      for (const double v : {x, std::nextafter(x, kInf), std::nextafter(x, 0.0)}) out.push_back(v), out.push_back(-v);
    }
    for (int i = 1; i < 64; ++i) out.push_back(i * (kPi / 2)), out.push_back(i * 997.0 * (kPi / 2));
    return out;
  }();
  return all;
}

constexpr int kRandom = test::kSlowMachine ? 20'000 : 400'000;

TEST(SinCos, AnyArgument_IsWithinTwoAndAHalfUlp) {
  double worst = 0.0;
  const auto take = [&](double x) {
    const math::SinCos both = math::sin_cos(x);
    worst = std::max({worst, error_ulp(both.sin, std::sin(static_cast<long double>(x))),
                      error_ulp(both.cos, std::cos(static_cast<long double>(x)))});
  };
  Arguments arguments;
  for (const double x : hard_arguments()) take(x);
  for (int i = 0; i < kRandom; ++i) {
    take(arguments.within(4.0)), take(arguments.within(1e5)), take(arguments.any_bits());
  }
  EXPECT_LT(worst, 2.5);
  EXPECT_EQ(math::sin(1.0), math::sin_cos(1.0).sin);
  EXPECT_EQ(math::cos(1.0), math::sin_cos(1.0).cos);
  EXPECT_TRUE(std::isnan(math::sin(kInf)) && std::isnan(math::cos(-kInf)) && std::isnan(math::sin(kNan)));
}

TEST(SinCos, OfSeveralAngles_IsThatOfEachToTheBit) {
  Arguments arguments;
  for (int i = 0; i < 20'000; ++i) {
    const double range_rad = i % 2 == 0 ? 4.0 : 1.2e5;  // every other time some are beyond the vector code
    std::array<double, 6> x_rad;
    for (double& x : x_rad) x = arguments.within(range_rad);
    const math::SinCosOf<6> together = math::sin_cos(x_rad);
    for (std::size_t n = 0; n < x_rad.size(); ++n) {
      const math::SinCos alone = math::sin_cos(x_rad[n]);
      ASSERT_EQ(std::bit_cast<std::uint64_t>(together.sin[n]), std::bit_cast<std::uint64_t>(alone.sin)) << x_rad[n];
      ASSERT_EQ(std::bit_cast<std::uint64_t>(together.cos[n]), std::bit_cast<std::uint64_t>(alone.cos)) << x_rad[n];
    }
  }
}

TEST(Exp, AnyArgument_IsWithinOneUlp) {
  double worst = 0.0;
  const auto take = [&](double x) {
    worst = std::max(worst, error_ulp(math::exp(x), std::exp(static_cast<long double>(x))));
  };
  Arguments arguments;
  for (const double x : hard_arguments()) take(x);
  for (int i = 0; i < kRandom; ++i) {
    take(arguments.within(746.0)), take(arguments.within(2.0)), take(arguments.of_any_size(60));
  }
  EXPECT_LT(worst, 1.0);
  EXPECT_EQ(math::exp(-kInf), 0.0);
  EXPECT_EQ(math::exp(kInf), kInf);
  EXPECT_EQ(math::exp(0.0), 1.0);
}

TEST(AsinAndAcos, AnyArgument_AreWithinTwoAndAHalfUlp) {
  double worst = 0.0;
  const auto take = [&](double x) {
    worst = std::max({worst, error_ulp(math::asin(x), std::asin(static_cast<long double>(x))),
                      error_ulp(math::acos(x), std::acos(static_cast<long double>(x)))});
  };
  Arguments arguments;
  for (const double x : hard_arguments()) take(x);
  for (int i = 0; i < kRandom; ++i) {
    take(arguments.within(1.0)), take(std::copysign(1.0 - std::abs(arguments.of_any_size(50)), arguments.within(1.0)));
    take(arguments.of_any_size(900));
  }
  EXPECT_LT(worst, 2.5);
  EXPECT_EQ(math::acos(1.0), 0.0);
  EXPECT_EQ(math::acos(-1.0), kPi);
  EXPECT_EQ(math::asin(-1.0), -kPi / 2);
}

TEST(Atan2, AnyArguments_IsWithinOneAndAHalfUlp) {
  double worst = 0.0;
  const auto take = [&](double y, double x) {
    worst = std::max(
        worst, error_ulp(math::atan2(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x))));
  };
  Arguments arguments;
  for (const double y : hard_arguments()) {
    for (const double x : hard_arguments()) take(y, x);
  }
  for (int i = 0; i < kRandom; ++i) {
    take(arguments.within(1.0), arguments.within(1.0)), take(arguments.of_any_size(30), arguments.of_any_size(30));
    take(arguments.any_bits(), arguments.any_bits());
  }
  EXPECT_LT(worst, 1.5);
}

TEST(Atan2, ZerosAndInfinities_AreTheLibrarys) {
  for (const double y : {0.0, -0.0, 1.0, -1.0, kInf, -kInf, kLeast, kMost}) {
    for (const double x : {0.0, -0.0, 1.0, -1.0, kInf, -kInf, kLeast, -kLeast, kMost, -kMost}) {
      EXPECT_EQ(std::bit_cast<std::uint64_t>(math::atan2(y, x)), std::bit_cast<std::uint64_t>(std::atan2(y, x)))
          << y << " " << x;
    }
  }
}

TEST(Transcendental, HardAndRandomArguments_GiveTheRecordedBits) {
  test::BitHash hash;
  const auto take = [&hash](double x, double y) {
    const math::SinCos both = math::sin_cos(x);
    hash.add(both.sin), hash.add(both.cos), hash.add(math::exp(x)), hash.add(math::asin(x)), hash.add(math::acos(x));
    hash.add(math::atan2(x, y));
  };
  for (const double x : hard_arguments()) {
    for (const double y : hard_arguments()) take(x, y);
  }
  Arguments arguments;
  for (int i = 0; i < 100'000; ++i) {
    const double near = arguments.within(1.0), angle_rad = arguments.within(7.0), any = arguments.any_bits();
    take(near, angle_rad), take(angle_rad, near), take(any, arguments.of_any_size(1000));
  }
  // The same in every preset.
  EXPECT_EQ(hash.value(), 5893882868405077098U);
}

}  // namespace
}  // namespace polygmap
