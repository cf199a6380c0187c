// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/column_image.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <vector>

namespace polygmap {
namespace {

constexpr RawRange kRange{200, 4000, 1000.0F};

// Rows of the rasters' length, of which a picture fills the beginning.
struct ReducedPicture {
  std::array<std::uint16_t, kDepthWidth_px> raw{};
  std::array<std::uint8_t, kHalfWidth_px> body{};
  std::array<float, kColumns> w{};
  std::array<std::uint8_t, kColumns> valid{};
  ReducedRow row;

  explicit ReducedPicture(std::initializer_list<std::uint16_t> pixels = {},
                          std::initializer_list<std::uint8_t> flags = {}) {
    std::copy(pixels.begin(), pixels.end(), raw.begin());
    std::copy(flags.begin(), flags.end(), body.begin());
    row = reduce_to_columns(kRange, raw.data(), flags.size() == 0 ? nullptr : body.data(),
                            static_cast<std::int32_t>(pixels.size()) / kColumn_px, w.data(), valid.data());
  }
};

TEST(ColumnImage, ValidPixels_GiveTheInverseOfTheirMean) {
  const ReducedPicture picture(
      {1000, 2000, 1000, 2000, 1000, 2000, 1000, 2000, 500, 500, 500, 500, 500, 500, 500, 500});
  EXPECT_FLOAT_EQ(picture.w[0], 1.0F / 1.5F);
  EXPECT_FLOAT_EQ(picture.w[1], 2.0F);
  EXPECT_EQ(picture.valid[0], 8);
  EXPECT_EQ(picture.row.measured_px, 16);
  EXPECT_EQ(picture.row.body_columns, 0);
}

TEST(ColumnImage, PixelsOutsideTheRange_DoNotCount) {
  const ReducedPicture picture({0,   1000, 65535, 4001, 0, 0,    0, 0,  //
                                199, 0,    4500,  0,    0, 4001, 0, 0,  //
                                200, 0,    0,     0,    0, 4000, 0, 0});
  EXPECT_FLOAT_EQ(picture.w[0], 1.0F);
  EXPECT_EQ(picture.valid[0], 1);
  EXPECT_EQ(picture.w[1], 0.0F);
  EXPECT_EQ(picture.valid[1], 0);
  EXPECT_FLOAT_EQ(picture.w[2], 2.0F / (0.2F + 4.0F));
  EXPECT_EQ(picture.valid[2], 2);
  EXPECT_EQ(picture.row.measured_px, 3);
}

TEST(ColumnImage, BodyPixels_DoNotCountAndThreeEmptyTheirColumn) {
  const ReducedPicture picture({1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000,
                                1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000},
                               {0, 0, 0, 0, 0, kPixelBody, kPixelBody, 0, kPixelBody, kPixelBody, 0, kPixelBody});
  EXPECT_GT(picture.w[0], 0.0F);
  EXPECT_GT(picture.w[1], 0.0F);
  EXPECT_EQ(picture.valid[1], 4);
  EXPECT_EQ(picture.w[2], 0.0F);
  EXPECT_EQ(picture.valid[2], 0);
  EXPECT_EQ(picture.row.measured_px, kColumn_px + 4);
  EXPECT_EQ(picture.row.body_columns, 1);
}

// Behind a picture's last row there is nothing to read: its row ends anywhere in a register.
TEST(ColumnImage, RowOfAnyLength_IsReadToItsEndOnly) {
  for (std::int32_t columns = 1; columns <= 40; ++columns) {
    ReducedPicture picture;
    const std::vector<std::uint16_t> raw(static_cast<std::size_t>(kColumn_px * columns), 1000);
    picture.body.fill(kPixelBody);
    std::fill_n(picture.body.begin(), kColumn_px / 2 * columns, std::uint8_t{0});
    picture.row =
        reduce_to_columns(kRange, raw.data(), picture.body.data(), columns, picture.w.data(), picture.valid.data());
    EXPECT_EQ(picture.row.measured_px, kColumn_px * columns);
    EXPECT_EQ(picture.row.body_columns, 0);
    for (std::int32_t g = 0; g < kColumns; ++g) {
      ASSERT_EQ(picture.w[static_cast<std::size_t>(g)], g < columns ? 1.0F : 0.0F) << g << " of " << columns;
    }
  }
}

// Every pixel value in every place, against the same sum one pixel at a time: the result that all machines have.
TEST(ColumnImage, VectorsOfAnyWidth_GiveTheResultOfOneColumn) {
  std::uint32_t state = 1;
  for (int repeat = 0; repeat < 50; ++repeat) {
    ReducedPicture picture;
    for (std::uint16_t& raw : picture.raw)
      raw = static_cast<std::uint16_t>((state = state * 1664525U + 1013904223U) >> 19U);
    picture.row =
        reduce_to_columns(kRange, picture.raw.data(), nullptr, kColumns, picture.w.data(), picture.valid.data());
    for (std::size_t g = 0; g < kColumns; ++g) {
      float n = 0.0F, sum = 0.0F;
      for (std::size_t i = 0; i < kColumn_px; ++i) {
        const std::uint16_t raw = picture.raw[kColumn_px * g + i];
        if (raw < kRange.min || raw > kRange.max) continue;
        n += 1.0F;
        sum += static_cast<float>(raw);
      }
      ASSERT_EQ(picture.w[g], n * kRange.per_metre / std::max(sum, 1.0F)) << g;
      ASSERT_EQ(static_cast<float>(picture.valid[g]), n);
    }
  }
}

}  // namespace
}  // namespace polygmap
