// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/column_image.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace polygmap {
namespace {

constexpr RawRange kRange{200, 4000, 1000.0F};

TEST(ColumnImage, ValidPixels_AreAveragedAsInverseDepth) {
  const std::vector<std::uint16_t> raw{1000, 2000, 1000, 2000, 500, 500, 500, 500};
  std::array<float, 2> w{};
  std::array<std::uint8_t, 2> valid{};
  reduce_to_columns(kRange, raw.data(), nullptr, 2, w.data(), valid.data());
  EXPECT_FLOAT_EQ(w[0], 0.75F);
  EXPECT_FLOAT_EQ(w[1], 2.0F);
  EXPECT_EQ(valid[0], 4);
}

TEST(ColumnImage, PixelsOutsideTheRange_DoNotCount) {
  const std::vector<std::uint16_t> raw{0, 1000, 65535, 4001, 199, 0, 4500, 0, 200, 4000, 0, 0};
  std::array<float, 3> w{};
  std::array<std::uint8_t, 3> valid{};
  reduce_to_columns(kRange, raw.data(), nullptr, 3, w.data(), valid.data());
  EXPECT_FLOAT_EQ(w[0], 1.0F);
  EXPECT_EQ(valid[0], 1);
  EXPECT_EQ(w[1], 0.0F);
  EXPECT_EQ(valid[1], 0);
  EXPECT_FLOAT_EQ(w[2], 0.5F * (5.0F + 0.25F));
  EXPECT_EQ(valid[2], 2);
}

TEST(ColumnImage, BodyPixels_EmptyTheirColumn) {
  const std::vector<std::uint16_t> raw(12, 1000);
  const std::vector<std::uint8_t> body{0, 0, kPixelBody, 0, 0, kPixelBody};
  std::array<float, 3> w{};
  std::array<std::uint8_t, 3> valid{};
  reduce_to_columns(kRange, raw.data(), body.data(), 3, w.data(), valid.data());
  EXPECT_GT(w[0], 0.0F);
  EXPECT_EQ(w[1], 0.0F);
  EXPECT_EQ(w[2], 0.0F);
  EXPECT_EQ(valid[1] + valid[2], 0);
}

}  // namespace
}  // namespace polygmap
