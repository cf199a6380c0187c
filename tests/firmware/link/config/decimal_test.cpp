// SPDX-License-Identifier: Apache-2.0
// Decimals as the C library reads them, without it.
#include "firmware/link/config/decimal.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>

namespace polygmap::link {
namespace {

double by_the_library(const Decimal& decimal) {
  return std::strtod((std::to_string(decimal.digits) + "e" + std::to_string(decimal.exponent)).c_str(), nullptr);
}
std::string text_of(double number) {
  FixedText<64> text;
  append(text, number);
  return std::string(text.view());
}

TEST(Decimal, ToDouble_RandomDigits_IsCorrectlyRounded) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200'000; ++i) {
    const std::uint64_t digits = random() >> (random() % 64U);
    const int exponent = static_cast<int>(random() % 57U) + Decimal::kLeastExponent;
    const Decimal decimal{digits % 10'000'000'000'000'000'000U, exponent};
    ASSERT_EQ(to_double(decimal), by_the_library(decimal)) << decimal.digits << "e" << exponent;
  }
}

// Next to the middle of two doubles, where rounding is decided by the last digit or by the even one.
TEST(Decimal, ToDouble_NearHalfways_IsCorrectlyRounded) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 20'000; ++i) {
    const std::uint64_t half = (random() % (std::uint64_t{1} << 53U) | (std::uint64_t{1} << 53U)) * 2 + 1;  // 55 bits
    for (const std::uint64_t digits : {half - 1, half, half + 1}) {
      const Decimal decimal{digits, 0};
      ASSERT_EQ(to_double(decimal), static_cast<double>(digits)) << digits;
    }
  }
}

TEST(Decimal, ToDouble_SmallAndRound_AreExact) {
  EXPECT_EQ(to_double({0, 0}), 0.0);
  EXPECT_EQ(to_double({0, -5}), 0.0);
  EXPECT_EQ(to_double({1, 0}), 1.0);
  EXPECT_EQ(to_double({5, -1}), 0.5);
  EXPECT_EQ(to_double({1, -37}), 1e-37);
  EXPECT_EQ(to_double({1, 19}), 1e19);
  EXPECT_EQ(to_double({9'007'199'254'740'993, 0}), 9'007'199'254'740'992.0);
}

TEST(Decimal, Append_BoundsOfParameters_AreShort) {
  EXPECT_EQ(text_of(0.0), "0");
  EXPECT_EQ(text_of(3.0), "3");
  EXPECT_EQ(text_of(-2.5), "-2.5");
  EXPECT_EQ(text_of(0.3), "0.3");
  EXPECT_EQ(text_of(0.00001), "0.00001");
  EXPECT_EQ(text_of(1e11), "100000000000");
  EXPECT_EQ(text_of(0.1 + 0.2), "0.3");
  EXPECT_EQ(text_of(3.141592653589793), "3.14159265359");
  EXPECT_EQ(text_of(1e300), "1000000000000000");
}

}  // namespace
}  // namespace polygmap::link
