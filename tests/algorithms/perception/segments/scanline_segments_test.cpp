// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/segments/scanline_segments.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/support/column_scene.hpp"

namespace polygmap {
namespace {

using test::ColumnScene;

class ScanlineSegmentationTest : public testing::Test {
 protected:
  const ScanlineSegmentation::Columns& segment(std::int32_t rows = ScanlineSegmentation::kBlock) {
    segments_->begin({}, {}, scene_.intrinsics, *scene_.image);
    for (std::int32_t r = 0; r < kDepthHeight_px; r += rows) segments_->add_rows(r, r + rows - 1);
    segments_->finish();
    return segments_->columns();
  }
  ColumnScene scene_;
  std::unique_ptr<ScanlineSegmentation> segments_ = std::make_unique<ScanlineSegmentation>();
  InversePlane floor_ = test::plane_of({0.1, -0.8, -0.6}, 0.8);
  InversePlane riser_ = test::plane_of({0.0, 0.6, -0.8}, 0.6);
};

TEST_F(ScanlineSegmentationTest, OnePlane_OneExactSegmentPerColumn) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r >= 40 && r < 470 ? &floor_ : nullptr; });
  for (std::int32_t g = 0; g < kColumns; ++g) {
    const ScanlineSegmentation::Column& segments = segment()[static_cast<std::size_t>(g)];
    ASSERT_EQ(segments.size(), 1U) << g;
    EXPECT_EQ(segments[0].top, 40);
    EXPECT_EQ(segments[0].bottom, 469);
    EXPECT_NEAR(static_cast<double>(segments[0].inverse_depth), floor_.inverse_depth(scene_.ray(g, 40)), 2e-5);
    EXPECT_NEAR(static_cast<double>(segments[0].slope), floor_.m.y() / scene_.intrinsics.fy_px, 1e-7);
    if (g > 5) break;
  }
}

TEST_F(ScanlineSegmentationTest, CreaseJumpAndGap_EndTheSegment_NoiseDoesNot) {
  // Rows 0..199 riser, 200..299 floor, 300..319 nothing, 320..479 floor again.
  scene_.paint(
      [this](std::int32_t, std::int32_t r) -> const InversePlane* {
        const InversePlane* below = r < 300 || r >= 320 ? &floor_ : nullptr;
        return r < 200 ? &riser_ : below;
      },
      0.0015, 3);
  std::size_t exact = 0;
  for (const ScanlineSegmentation::Column& segments : segment()) {
    if (segments.size() != 3) continue;
    ++exact;
    EXPECT_NEAR(segments[0].bottom, 199, 3);
    EXPECT_NEAR(segments[1].bottom, 299, 1);
    EXPECT_NEAR(segments[2].top, 320, 1);
  }
  EXPECT_GE(exact, std::size_t{kColumns} * 9 / 10);
}

TEST_F(ScanlineSegmentationTest, SingleOutliersAndShortGaps_StayInsideTheSegment) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r >= 40 ? &floor_ : nullptr; });
  for (std::int32_t g = 0; g < kColumns; ++g) {
    scene_.image->inverse_depth(g, 100) *= 1.3F;
    scene_.image->inverse_depth(g, 101) *= 0.8F;
    for (std::int32_t r = 200; r < 206; ++r) scene_.image->inverse_depth(g, r) = 0.0F;
  }
  for (const ScanlineSegmentation::Column& segments : segment()) {
    ASSERT_EQ(segments.size(), 1U);
    EXPECT_EQ(segments[0].rows(), kDepthHeight_px - 40);
  }
}

// So near that a column without a segment once took them for rows of the one it has not: it then began at row 0.
TEST_F(ScanlineSegmentationTest, DepthsOfOneMillimetre_BeginTheirOwnSegment) {
  for (std::int32_t g = 0; g < kColumns; ++g) {
    for (std::int32_t r = 50; r < 90; ++r) scene_.image->inverse_depth(g, r) = 1000.0F;
  }
  for (const ScanlineSegmentation::Column& segments : segment()) {
    ASSERT_EQ(segments.size(), 1U);
    EXPECT_EQ(segments[0].top, 50);
    EXPECT_EQ(segments[0].bottom, 89);
  }
}

// Whatever register a column lies in, it says the same.
TEST_F(ScanlineSegmentationTest, EqualColumns_GiveEqualSegments) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r / 37 % 2 == 0 ? &riser_ : &floor_; }, 0.002, 5);
  for (std::int32_t r = 0; r < kDepthHeight_px; ++r) {
    for (std::int32_t g = 1; g < kColumns; ++g) scene_.image->inverse_depth(g, r) = scene_.image->inverse_depth(0, r);
  }
  const ScanlineSegmentation::Columns& columns = segment();
  ASSERT_GE(columns[0].size(), 8U);
  for (const ScanlineSegmentation::Column& segments : columns) {
    ASSERT_EQ(segments.size(), columns[0].size());
    for (std::size_t k = 0; k < segments.size(); ++k) {
      EXPECT_EQ(segments[k].top, columns[0][k].top);
      EXPECT_EQ(segments[k].bottom, columns[0][k].bottom);
      EXPECT_EQ(segments[k].slope, columns[0][k].slope);
    }
  }
}

// Two planes, dropouts and noise in whole numbers: not one bit may depend on the width of the machine's registers.
TEST_F(ScanlineSegmentationTest, VectorsOfAnyWidth_GiveTheSameSegments) {
  std::uint32_t state = 1, hash = 2166136261U;
  for (std::int32_t r = 0; r < kDepthHeight_px; ++r) {
    for (std::int32_t g = 0; g < kColumns; ++g) {
      const std::uint32_t draw = (state = state * 1664525U + 1013904223U) >> 22U;
      const std::int32_t along = (r + g / 4) % 60, depth = along < 25 ? 1000 - 2 * along : 900 + 6 * along;
      const float noise = static_cast<float>(draw % 64U) * (1.0F / 16384.0F);
      scene_.image->inverse_depth(g, r) = draw < 30U ? 0.0F : 512.0F / static_cast<float>(depth) + noise;
    }
  }
  const auto add = [&hash](std::uint32_t value) { hash = (hash ^ value) * 16777619U; };
  std::size_t count = 0;
  for (const ScanlineSegmentation::Column& segments : segment()) {
    count += segments.size();
    for (const polygmap::ScanlineSegment& segment : segments) {
      add(static_cast<std::uint32_t>(segment.top));
      add(static_cast<std::uint32_t>(segment.bottom));
      add(std::bit_cast<std::uint32_t>(segment.inverse_depth));
      add(std::bit_cast<std::uint32_t>(segment.slope));
    }
  }
  EXPECT_GT(count, std::size_t{kColumns} * 12);
  EXPECT_EQ(hash, 1394051180U);
}

// Rows that are added together are the same least squares as one after the other.
TEST_F(ScanlineSegmentationTest, RowsInBlocks_GiveTheSegmentsOfRowsOneByOne) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r / 37 % 2 == 0 ? &riser_ : &floor_; }, 0.002, 5);
  const ScanlineSegmentation::Columns one_by_one = segment(1);
  const ScanlineSegmentation::Columns& in_blocks = segment();
  std::size_t segments = 0, same_ends = 0, same_lines = 0;
  for (std::size_t g = 0; g < kColumns; ++g) {
    segments += one_by_one[g].size();
    for (std::size_t k = 0; k < std::min(one_by_one[g].size(), in_blocks[g].size()); ++k) {
      const polygmap::ScanlineSegment &a = one_by_one[g][k], &b = in_blocks[g][k];
      if (a.top != b.top || a.bottom != b.bottom) continue;
      ++same_ends;
      // A row that is an outlier to one of them only moves the line.
      same_lines +=
          std::abs(a.slope - b.slope) < 1e-7F && std::abs(a.inverse_depth - b.inverse_depth) < 1e-5F ? 1U : 0U;
    }
  }
  EXPECT_GT(segments, std::size_t{kColumns} * 12);
  EXPECT_GT(static_cast<double>(same_ends), 0.95 * static_cast<double>(segments));
  EXPECT_GT(static_cast<double>(same_lines), 0.95 * static_cast<double>(segments));
}

TEST_F(ScanlineSegmentationTest, MoreSegmentsThanFit_AreCounted) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r / 5 % 2 == 0 ? &riser_ : &floor_; });
  static_cast<void>(segment());
  EXPECT_GT(segments_->overflow(), 0U);
  for (const ScanlineSegmentation::Column& segments : segments_->columns()) {
    for (const polygmap::ScanlineSegment& segment : segments) EXPECT_LE(segment.top, segment.bottom);
  }
}

// Five groups of eight columns, half of a register of sixteen beyond them: nobody pays for that half.
TEST_F(ScanlineSegmentationTest, NarrowPicture_IsPaidForWhateverTheRegistersWidth) {
  scene_.intrinsics.width_px = 5 * 8 * kColumn_px;
  segment();
  const std::int32_t blocks = kDepthHeight_px / ScanlineSegmentation::kBlock;
  EXPECT_EQ(segments_->work().instructions(), blocks * 5 * (90 + 455) + 40 * 60);
}

}  // namespace
}  // namespace polygmap
