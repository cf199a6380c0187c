// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/change_point.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

using simd::all, simd::Four, simd::Wide;

TEST(ChangePoint, Gains_FallThenRise_IsTheLastPixelOfTheFall) {
  ChangePoint<double> point{0.0, 0.0, -1.0};
  const std::array<double, 6> gains{-2.0, 1.0, -3.0, 0.0, 4.0, -3.5};
  for (std::size_t i = 0; i < gains.size(); ++i) point.add(gains[i], static_cast<double>(i));
  EXPECT_EQ(point.at, 2.0);  // the first of two pixels with the least sum
  EXPECT_EQ(point.least, -4.0);
  EXPECT_EQ(point.sum, -3.5);
}

TEST(ChangePoint, Gains_NeverBelowNothing_IsBeforeTheFirstPixel) {
  ChangePoint<double> point{0.0, 0.0, -1.0};
  for (int i = 0; i < 4; ++i) point.add(0.5, i);
  EXPECT_EQ(point.at, -1.0);
}

TEST(ChangePoint, VectorOfSearches_EverySlot_IsWhatThatSearchAloneFinds) {
  ChangePoint<Wide> wide{all(0.0), all(0.0), all(-1.0)};
  std::array<ChangePoint<double>, Wide::nlanes> alone;
  alone.fill({0.0, 0.0, -1.0});
  for (int i = 0; i < 20; ++i) {
    std::array<float, Wide::nlanes> gains;
    for (std::size_t k = 0; k < gains.size(); ++k) {
      gains[k] = static_cast<float>((7 * i + 5 * static_cast<int>(k)) % 11 - 5);
      alone[k].add(static_cast<double>(gains[k]), i);
    }
    wide.add(cv::vx_load(gains.data()), all(i));
  }
  std::array<float, Wide::nlanes> at;
  cv::v_store(at.data(), wide.at);
  for (std::size_t k = 0; k < at.size(); ++k) EXPECT_EQ(static_cast<double>(at[k]), alone[k].at) << k;
}

TEST(Simd, RunningSums_TwoRegisters_GoOnFromTheFirst) {
  Four before = cv::v_setzero_f32();
  std::array<float, 8> sums;
  for (std::int32_t i = 0; i < 8; i += 4) {
    cv::v_store(sums.data() + i, simd::running_sums(cv::v_load(simd::kSteps.data() + i), before));
  }
  float sum = 0.0F;
  for (std::size_t i = 0; i < sums.size(); ++i) EXPECT_EQ(sums[i], sum += static_cast<float>(i)) << i;
}

TEST(Simd, LoadsOfBytes_EverySlot_IsThatNumber) {
  std::array<std::uint8_t, 16> bytes;
  std::array<std::uint16_t, 16> words;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(255 - i);
    words[i] = static_cast<std::uint16_t>(65535 - i);
  }
  std::array<float, Wide::nlanes> of_bytes, of_words;
  cv::v_store(of_bytes.data(), simd::load_u8(bytes.data() + 1));
  cv::v_store(of_words.data(), simd::load_u16(words.data() + 1));
  for (std::size_t i = 0; i < of_bytes.size(); ++i) {
    EXPECT_EQ(of_bytes[i], 254.0F - static_cast<float>(i));
    EXPECT_EQ(of_words[i], 65534.0F - static_cast<float>(i));
  }
  EXPECT_EQ(simd::bits(simd::steps_from(0) > all(0.5F)), (1U << Wide::nlanes) - 2U);
}

}  // namespace
}  // namespace polygmap
